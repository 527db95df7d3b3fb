"""Linear, bent, twisted and combined deformations of a block, and the goals of each mode (paper 3's figure 3.10)."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from palpate.report import style
from palpate.report.number_format import percent

TABLES = ("deformation_modes",)
_MODES = {"rigid": "#0072b2", "linear": "#009e73", "quadratic": "#d55e00"}
_SEEN_FROM = np.array([[0.9, 0.43, 0.0], [-0.15, 0.31, 0.94]])
"""The directions of the picture, across and up, in space."""


@style.styled
def draw(deformation_modes) -> Figure:
    """Draw a row for each mode and a column for each deformation: the block as it is in grey, and its goals.

    deformation_modes : the table of this name
    """
    table = deformation_modes
    deformations = list(dict.fromkeys(table["deformation"]))
    figure = Figure(figsize=(1.7 * len(deformations) + 0.6, 2.5 * len(_MODES)), layout="constrained")
    axes = figure.subplots(len(_MODES), len(deformations), sharex=True, sharey=True, squeeze=False)
    for row, (mode, colour) in zip(axes, _MODES.items(), strict=True):
        for axis, deformation in zip(row, deformations, strict=True):
            group = table[(table["deformation"] == deformation) & (table["mode"] == mode)]
            _lattice(axis, group, "", style.FAINT, 1.6)
            _lattice(axis, group, "goal_", colour, 0.7)
            left = group["left"].iloc[0]
            axis.annotate(f"misses {percent(left)}" if left > 1e-9 else "follows", (0.5, 0.0), (0, -2), fontsize=8,
                          xycoords="axes fraction", textcoords="offset points", ha="center", va="top")  # fmt: skip
            axis.set_axis_off()
            axis.set_aspect("equal")
            axis.autoscale()
        row[0].annotate(mode, (0.0, 0.5), xycoords="axes fraction", rotation=90, ha="right", va="center", color=colour)
    for axis, deformation in zip(axes[0], deformations, strict=True):
        axis.set_title(deformation)
    return figure


def _lattice(axis, group, which: str, colour: str, width: float) -> None:
    """Join particles that are neighbours at rest; ``which`` begins the names of the columns of their places."""
    rest = group[[f"rest_{axis}_m" for axis in "xyz"]].to_numpy()
    places = 100.0 * group[[f"{which}{axis}_m" for axis in "xyz"]].to_numpy() @ _SEEN_FROM.T
    order = {tuple(np.round(node, 9)): number for number, node in enumerate(rest)}
    lines = []
    for side in range(3):
        steps = np.diff(np.unique(np.round(rest[:, side], 9)))
        for node, number in order.items():
            other = list(node)
            other[side] += steps.min() if len(steps) else 0.0
            if (next_to := order.get(tuple(np.round(other, 9)), number)) != number:
                lines.append(places[[number, next_to]])
    axis.add_collection(LineCollection(lines, colors=colour, linewidths=width))
