"""Bending of a column with more clusters under the same load (paper 3's figure 3.11)."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from palpate.report import style

TABLES = ("clusters",)
_COLOURS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#e6b400")


@style.styled
def draw(clusters) -> Figure:
    """Draw one column per panel from the side, its particles coloured by displacement, and its rest shape in grey.

    clusters : the table of this name
    """
    groups = list(clusters.groupby("clusters"))
    figure = Figure(figsize=(2.0 * len(groups) + 2.6, 4.2), layout="constrained")
    axes = figure.subplots(1, len(groups) + 1, width_ratios=[2.0] * len(groups) + [2.4])
    moved = _displacement(clusters)
    norm = matplotlib.colors.Normalize(0.0, 100.0 * np.linalg.norm(moved, axis=1).max())
    places = 100.0 * np.concatenate([clusters[["rest_x_m", "rest_z_m"]], clusters[["x_m", "z_m"]]])
    (left, low), (right, high) = places.min(axis=0) - 1.5, places.max(axis=0) + 1.5
    for axis, (count, group), colour in zip(axes, groups, _COLOURS, strict=False):
        _lattice(axis, group, ["rest_x_m", "rest_z_m"], style.FAINT, 0.7)
        _lattice(axis, group, ["x_m", "z_m"], style.INK, 0.9)
        farther = 100.0 * np.linalg.norm(_displacement(group), axis=1)
        dots = axis.scatter(
            *(100.0 * group[["x_m", "z_m"]].to_numpy().T),
            c=farther,
            norm=norm,
            cmap=style.DISPLACEMENT,
            s=18,
            edgecolors=style.INK,
            linewidths=0.4,
            zorder=3,
        )
        axis.set_title(f"{count} cluster{'s' if count > 1 else ''}\ntip moves {farther.max():.1f} cm", color=colour)
        axis.set(xlim=(left, right), ylim=(low, high), aspect="equal", xlabel="x [cm]")
        axis.label_outer()
        height, sideways = _profile(group)
        axes[-1].plot(sideways, height, color=colour, marker="o", ms=3, label=str(count))
    axes[0].set_ylabel("height [cm]")
    axes[-1].set(xlabel="sideways displacement [cm]", ylabel="height at rest [cm]")
    axes[-1].set_title(f"{clusters['force_n'].iloc[0]:g} N on the top\nof {len(groups[0][1])} particles")
    axes[-1].legend(title="clusters", loc="lower right")
    figure.colorbar(
        dots, ax=axes[:-1], orientation="horizontal", shrink=0.5, aspect=40, label="displacement [cm] (grey: at rest)"
    )
    return figure


def _displacement(table) -> np.ndarray:
    return table[["x_m", "y_m", "z_m"]].to_numpy() - table[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()


def _lattice(axis, group, columns: list[str], colour: str, width: float) -> None:
    """Join particles that are neighbours along x or z at rest."""
    for across, along in (("rest_x_m", "rest_z_m"), ("rest_z_m", "rest_x_m")):
        for _, line in group.sort_values(along).groupby([across, "rest_y_m"]):
            axis.plot(*(100.0 * line[columns].to_numpy().T), color=colour, lw=width)


def _profile(group) -> tuple[np.ndarray, np.ndarray]:
    """Compute the height at rest and the mean displacement along x of each layer, both [cm]."""
    layers = (group["x_m"] - group["rest_x_m"]).groupby(group["rest_z_m"]).mean()
    return 100.0 * layers.index.to_numpy(), 100.0 * layers.to_numpy()
