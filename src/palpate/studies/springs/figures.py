"""Figures of paper 2: searches, errors over time, and the least error that springs reach."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.report import style, tables
from palpate.report.model_looks import DASHES, FITS, FORCES, look
from palpate.scenes.acting_effects import SPRING_POISSON

_POINTS = 200
"""Number of generations or times at which the seeds of a search are compared."""


@style.figure("spring_fit", tables=("spring_history",))
def draw_spring_fit(spring_history) -> Figure:
    """Draw −fitness over generations (left) and over time (right), without and with the volume force.

    A line is the median of the seeds and a band their range. A method without a search is a marker at its time and a
    constant line from there.
    """
    history = spring_history[spring_history["method"] != "gradient_all"]  # its fitness is a sum of three presses
    figure, grid = style.panels(2, 2, (9.5, 6.2), sharey=True, sharex="col")
    last_s = 1.2 * history["seconds"].max()
    for (over_generations, over_time), force in zip(grid, FORCES, strict=True):
        rows = tables.where(history, volume_force=force)
        for method, of_method in rows.groupby("method", sort=False):
            if of_method["generation"].max() == 0:
                _at_once(over_time, of_method, look(method), last_s)
                continue
            _band(over_generations, of_method, "generation", look(method), np.linspace)
            _band(over_time, of_method, "seconds", look(method), np.geomspace)
        over_generations.set(title=FORCES[force], ylabel="−fitness [m]")
    for axis in grid[-1]:
        axis.set(yscale="log", ylim=(0.6 * -history["fitness"].max(), None))
        style.plain_log(axis.yaxis)
    over_generations.set(xlabel="generation or iteration")
    over_time.set(xscale="log", xlabel="time of the search [s]", xlim=(history["seconds"].min() / 1.5, last_s))
    style.plain_log(over_time.xaxis)
    figure.legend(handles=_legend(history), loc="outside upper center", ncols=4, title="less is better")
    return figure


def best_so_far(runs, column: str, places: np.ndarray) -> np.ndarray:
    """Compute the best −fitness so far of each seed, (seeds, places), at ``places`` on the axis ``column``.

    It is NaN before a seed's first value; a seed that has ended keeps its last value.
    """
    curves = []
    for _, run in runs.groupby("seed", sort=False):
        run = run.sort_values(column)
        best = np.minimum.accumulate(-run["fitness"].to_numpy())
        count = np.searchsorted(run[column].to_numpy(), places, side="right")
        curves.append(np.where(count > 0, best[np.maximum(count, 1) - 1], np.nan))
    return np.array(curves)


def _band(axis, runs, column, look, spacing) -> None:
    """Draw the median and range of the seeds of one search over ``column``, from where all seeds have a value."""
    starts, ends = runs.groupby("seed")[column].agg(["min", "max"]).max()
    places = spacing(starts, ends, _POINTS)
    curves = best_so_far(runs, column, places)
    axis.fill_between(places, curves.min(axis=0), curves.max(axis=0), color=look.colour, alpha=0.25, lw=0)
    axis.plot(places, np.median(curves, axis=0), color=look.colour)


def _at_once(axis, runs, look, last_s: float) -> None:
    """Draw a method without a search: a marker at its time, and a line at its −fitness up to ``last_s`` [s]."""
    time_s, unfitness = runs["seconds"].median(), -runs["fitness"].median()
    axis.plot([time_s, last_s], [unfitness, unfitness], color=look.colour, lw=0.8, ls=":")
    axis.plot(time_s, unfitness, look.marker, color=look.colour, mec="white", mew=0.6, ms=8)


def _legend(history) -> list:
    """Return the handles of all methods in the table, in table order, and of the band."""
    searched = history.groupby("method")["generation"].max() > 0
    handles = []
    for method, shown in FITS.items():
        if method in searched:
            looks: dict[str, Any] = {"ls": "-"} if searched[method] else {"ls": ":", "marker": shown.marker}
            handles.append(Line2D([], [], color=shown.colour, label=shown.label, **looks))
    seeds = history.groupby("method")["seed"].nunique().max()
    return [*handles, Patch(color=style.FAINT, alpha=0.4, lw=0, label=f"range of {seeds} seeds, line: median")]


SHOWN = ["uniform", "genetic", "gradient", "gradient_smooth", "gradient_all"]
"""The simplest method, the paper's, and the fits by gradient; the table has the others."""


@style.figure("spring_errors", tables=("spring_errors",))
def draw_spring_errors(spring_errors) -> Figure:
    """Draw the error of the point that moves most, one row for each press and one column for each axis.

    It is simulated minus reference, the median of the seeds. A row says how far anything moves, which is the error of
    an answer without motion.
    """
    errors = spring_errors
    # gradient_all is fitted to all presses, which is not counted here
    presses = errors.groupby("press", sort=False)["used_in_fit"].mean() > 0.5
    figure, grid = style.panels(len(presses), 3, (9.5, 2.1 * len(presses) + 1.1), sharex=True, sharey="row")
    shown = errors[errors["method"].isin(SHOWN)]
    for axes, (press, fitted) in zip(grid, presses.items(), strict=True):
        for axis, name in zip(axes, "xyz", strict=True):
            for (method, force), rows in tables.where(shown, press=press).groupby(["method", "volume_force"]):
                curve = (1e3 * rows.groupby("step")[f"error_{name}_m"].median()).sort_index()
                axis.plot(curve.index, curve, color=look(method).colour, ls=DASHES[force], lw=1.2)
            axis.axhline(0.0, color=style.FAINT, lw=0.8)
            axis.set_title(f"{press} press, {name}{' (fitted)' if fitted else ''}")
        moved_mm = 1e3 * tables.where(shown, press=press)["zero_m"].max()
        axes[0].set_ylabel(f"error [mm]\nmoved: {moved_mm:.2g} mm")
    for axis in grid[-1]:
        axis.set_xlabel("step")
    lines = [Line2D([], [], color=FITS[m].colour, label=FITS[m].label) for m in SHOWN if m in set(shown["method"])]
    forces = [Line2D([], [], color=style.INK, ls=DASHES[force], label=FORCES[force]) for force in FORCES]
    figure.legend(handles=[*lines, *forces], loc="outside upper center", ncols=3)
    return figure


_MARKERS = {False: "o", True: "s"}


@style.figure("spring_floor", tables=("spring_floor",))
def draw_spring_floor(spring_floor) -> Figure:
    """Draw the error over the reference's Poisson ratio, one panel for each press, with and without the volume force.

    The springs are fitted to all presses by gradient.
    """
    floor = spring_floor
    presses = list(dict.fromkeys(floor["press"]))
    figure, (axes,) = style.panels(1, len(presses), (9.5, 3.6), sharey=True)
    colour = FITS["gradient"].colour
    for axis, press in zip(axes, presses, strict=True):
        axis.axvline(SPRING_POISSON, color=style.FAINT, ls=":", lw=1)
        for force, marker in _MARKERS.items():
            rows = tables.where(floor, press=press, volume_force=force).sort_values("poisson")
            error = 100 * rows["rmse_of_peak"]
            axis.plot(rows["poisson"], error, marker, color=colour, ls=DASHES[force], ms=4.5, mec="white", mew=0.5)
        axis.set(title=f"{press} press", xlabel="Poisson's ratio of the reference")
    axes[0].set(ylabel="RMSE [% of peak]", ylim=(0, None))  # after all panels, as they share it
    handles = [
        Line2D([], [], color=colour, ls=DASHES[force], marker=marker, ms=4.5, label=FORCES[force])
        for force, marker in _MARKERS.items()
    ]
    handles.append(Line2D([], [], color=style.FAINT, ls=":", lw=1, label="the springs' own ratio"))
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure
