"""Draw what is known of the error of a single answer: how sharp its bounds are, and how often they hold."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.conformal import LEVEL
from palpate.report import style, tables

TABLES = ("error_bounds",)
SOURCES = {
    "constant": "nothing: the same for all",
    "linear": "the peak of the linear response",
    "turned": "the rotations of the linear response",
    "distance": "the distance to what was learnt from",
    "residual": "one fine residual",
    "coarser": "a second answer, of coarser elements",
    "own": "the model itself",
}
"""The estimates by what they are made from, in words."""
DEAR = ("residual", "coarser")
"""Those that cost a simulation, or a part of one; the others take next to nothing."""
_COLOURS = dict(
    zip(SOURCES, ("#9a9a9a", "#e6b400", "#009e73", "#56b4e9", "#d55e00", "#0072b2", "#7a3b63"), strict=True)
)
_JITTER = 0.18
"""Half width over which the points of one estimate are spread."""


@style.styled
def draw(error_bounds) -> Figure:
    """Draw bound over error against the rank correlation, and the shares of answers below their bounds.

    error_bounds : the table of this name, of which the errors over the surface are drawn; a point a setting and scene
    """
    found = tables.where(error_bounds, error="rms")
    figure = Figure(figsize=(9.5, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[3, 2.4])
    names = [name for name in SOURCES if name in set(found["estimate"])]
    for place, name in enumerate(names):
        rows, colour = tables.where(found, estimate=name).dropna(subset="sharpness"), _COLOURS[name]
        points = {"ms": 4, "mec": colour, "alpha": 0.6, "ls": "", "marker": "o"}
        ranks = rows["rank_correlation"].fillna(0.0)
        left.plot(ranks, rows["sharpness"], mfc=colour, **points)
        spread = place + np.linspace(-_JITTER, _JITTER, max(len(rows), 2))[: len(rows)]
        right.plot(spread - 0.2, 100 * rows["coverage"], mfc=colour, **points)
        right.plot(spread + 0.25, 100 * rows["coverage_elsewhere"], mfc="none", **points)
    left.axhline(1, color=style.FAINT, lw=1, ls=":")
    left.set(yscale="log", xlabel="rank correlation of estimate and error", ylabel="bound over error, median")
    left.set(title="how sharp the bounds are")
    style.plain_log(left.yaxis)
    right.axhline(100 * LEVEL, color="#aa0000", lw=1, ls=(0, (4, 2)))
    right.set_xticks(range(len(names)), names)
    right.set(ylabel="answers below their bound [%]", ylim=(0, 103), title="how often they hold")
    right.grid(axis="x", visible=False)
    kinds = [Line2D([], [], ls="", marker="o", color=_COLOURS[name], label=SOURCES[name]) for name in names]
    kinds += [
        Line2D([], [], ls="", marker="o", color=style.INK, label="bound found on this body"),
        Line2D([], [], ls="", marker="o", mfc="none", color=style.INK, label="bound found on the other bodies"),
    ]
    figure.legend(handles=kinds, loc="outside lower center", ncols=3)
    return figure
