"""Draw where the corotational law itself has limit points: the dent against the pressure of a finger, by contact."""

from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.presses import PRESSURE
from palpate.report import style, tables
from palpate.studies.tradeoff.limit_points import jumps

TABLES = ("limit_points",)


@style.styled
def draw(limit_points) -> Figure:
    """Draw the peak displacement over the peak pressure of each contact; a panel per body.

    limit_points : the table of this name
    The colour is the least determinant of the deformation gradient; at 0 an element turns inside out. Steps in which
    the dent grows clearly faster than the load are drawn thick; loads without an equilibrium are crosses.
    """
    names = tables.bodies(limit_points)
    figure = Figure(figsize=(4.6 * len(names), 4.4), layout="constrained")
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    norm, cmap = Normalize(0, 1), "viridis"
    for axis, body in zip(axes, names, strict=True):
        for _, rows in tables.where(limit_points, body=body).groupby("contact", sort=False):
            _contact(axis, rows.sort_values("pressure_of_young"), norm, cmap)
        axis.axvline(PRESSURE, color="#555555", ls=":", lw=1)
        axis.set(title=body.replace("_", " "), xlabel="peak pressure [of Young's modulus]")
    axes[0].set_ylabel("peak displacement [% of the body's size]")
    figure.colorbar(ScalarMappable(norm, cmap), ax=axes, label="least determinant of the deformation gradient")
    handles = [
        Line2D([], [], color="#aa0000", lw=2.5, label="snap: the dent grows much faster than the load"),
        Line2D([], [], ls="", marker="x", color="#aa0000", label="no equilibrium found"),
        Line2D(
            [],
            [],
            color="#555555",
            ls=":",
            lw=1,
            label=f"the trade-off presses at most {PRESSURE:g}, unless a regime says otherwise",
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=1)
    return figure


def _contact(axis, rows, norm, cmap) -> None:
    """Draw one contact: a line, its snaps, its points, and crosses where there is no equilibrium."""
    found = rows[rows["converged"].astype(bool)]
    pressure, peak = found["pressure_of_young"].to_numpy(), 100 * found["peak_of_size"].to_numpy()
    axis.plot(pressure, peak, color="#bbbbbb", lw=1, zorder=1)
    for snap in jumps(found).itertuples():
        ends = [snap.pressure_of_young_before, snap.pressure_of_young_after]
        peaks = [100 * snap.peak_of_size_before, 100 * snap.peak_of_size_after]
        axis.plot(ends, peaks, color="#aa0000", lw=2.5, zorder=2)
    axis.scatter(pressure, peak, c=found["least_det"], norm=norm, cmap=cmap, s=22, edgecolors="white", lw=0.4, zorder=3)
    lost = rows[~rows["converged"].astype(bool)]
    top = peak[-1] if len(peak) else 0.0
    axis.plot(lost["pressure_of_young"], [top] * len(lost), "x", color="#aa0000", ms=6, zorder=4)
