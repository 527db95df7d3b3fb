"""Best fitness of each method for spring parameters over generations (paper 2's figure 2) and over time."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.report import style, tables
from palpate.report.spring_looks import FITS, FORCES, look

TABLES = ("spring_history",)
_POINTS = 200
"""Number of generations or times at which the seeds of a search are compared."""


@style.styled
def draw(spring_history) -> Figure:
    """Draw −fitness over generations (left) and over time (right), without and with the volume force.

    spring_history : the table of this name
    A line is the median of the seeds and a band their range. A method without a search is a marker at its time and a
    constant line from there.
    """
    history = spring_history[spring_history["method"] != "gradient_all"]  # its fitness is a sum of three presses
    figure = Figure(figsize=(9.5, 6.2), layout="constrained")
    grid = figure.subplots(2, 2, sharey=True, sharex="col")
    last = 1.2 * history["seconds"].max()
    for (over_generations, over_time), force in zip(grid, FORCES, strict=True):
        rows = tables.where(history, volume_force=force)
        for method, found in rows.groupby("method", sort=False):
            if found["generation"].max() == 0:
                _at_once(over_time, found, look(method), last)
                continue
            _band(over_generations, found, "generation", look(method), np.linspace)
            _band(over_time, found, "seconds", look(method), np.geomspace)
        over_generations.set(title=FORCES[force], ylabel="−fitness [m]")
    for axis in grid[-1]:
        axis.set(yscale="log", ylim=(0.6 * -history["fitness"].max(), None))
        style.plain_log(axis.yaxis)
    over_generations.set(xlabel="generation or iteration")
    over_time.set(xscale="log", xlabel="time of the search [s]", xlim=(history["seconds"].min() / 1.5, last))
    style.plain_log(over_time.xaxis)
    figure.legend(handles=_legend(history), loc="outside upper center", ncols=4, title="less is better")
    return figure


def best_so_far(found, column: str, places: np.ndarray) -> np.ndarray:
    """Compute −fitness of each seed at ``places`` of ``column``, (seeds, places); nan before its first value.

    A seed that has ended keeps its last value.
    """
    curves = []
    for _, run in found.groupby("seed", sort=False):
        run = run.sort_values(column)
        best = np.minimum.accumulate(-run["fitness"].to_numpy())
        known = np.searchsorted(run[column].to_numpy(), places, side="right")
        curves.append(np.where(known > 0, best[np.maximum(known, 1) - 1], np.nan))
    return np.array(curves)


def _band(axis, found, column, look, spread) -> None:
    """Draw the median and range of the seeds of one search, from the place where all seeds have a value."""
    starts, ends = found.groupby("seed")[column].agg(["min", "max"]).max()
    places = spread(starts, ends, _POINTS)
    curves = best_so_far(found, column, places)
    axis.fill_between(places, curves.min(axis=0), curves.max(axis=0), color=look.colour, alpha=0.25, lw=0)
    axis.plot(places, np.median(curves, axis=0), color=look.colour)


def _at_once(axis, found, look, last: float) -> None:
    """Draw a method without a search."""
    at, error = found["seconds"].median(), -found["fitness"].median()
    axis.plot([at, last], [error, error], color=look.colour, lw=0.8, ls=":")
    axis.plot(at, error, look.marker, color=look.colour, mec="white", mew=0.6, ms=8)


def _legend(history) -> list:
    """Return the handles of all methods in the table, in table order, and of the band."""
    searched = history.groupby("method")["generation"].max() > 0
    handles = []
    for method, way in FITS.items():
        if method in searched:
            looks: dict[str, Any] = {"ls": "-"} if searched[method] else {"ls": ":", "marker": way.marker}
            handles.append(Line2D([], [], color=way.colour, label=way.label, **looks))
    seeds = history.groupby("method")["seed"].nunique().max()
    return [*handles, Patch(color=style.FAINT, alpha=0.4, lw=0, label=f"range of {seeds} seeds, line: median")]
