"""Draw advice: errors within each budget, other kinds of load, and when preparing pays."""

from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.benchmark.choosing import NONE
from palpate.benchmark.load import DEPTH, LOADS
from palpate.benchmark.ranking import BY_ERROR, KINDS, averaged, own_error, pick
from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.report.words import percent, spaced
from palpate.report.work_precision import LEAST_PERCENT, OWN_COLOUR, curves, finish, handles, points
from palpate.studies.tradeoff.figures.scene_rows import answers

NAMES = {"rms": "RMSE", "patch": "RMS at the patch"}
"""The kinds of error that advice is asked for, as axes name them."""


@style.figure("advice", tables=("advice", "accuracy_vs_time"))
def draw_advice(advice, accuracy_vs_time) -> Figure:
    """Draw the advised model with its interval and its bound, the next best and the factor; a column for each budget.

    The upper panels are for the error over the surface, the lower ones for that at the patch; each has a row per scene.
    """
    names = tables.scenes(accuracy_vs_time)
    budget_rows = advice[advice["scene"].isin(names)].dropna(subset="budget_ms")
    kinds = [kind for kind in KINDS if kind in set(budget_rows["error"])]
    budgets = list(dict.fromkeys(budget_rows["budget_ms"]))
    rows = {scene: averaged(tables.where(accuracy_vs_time, scene=scene)) for scene in names}
    size = (1.4 + 3.3 * len(budgets), 0.6 + len(kinds) * (0.75 + 0.56 * len(names)))
    figure, panels = style.panels(len(kinds), len(budgets), size, sharex="row", sharey=True)
    for line, kind in zip(panels, kinds, strict=True):
        column = KINDS[kind]
        for axis, budget in zip(line, budgets, strict=True):
            for row_number, scene in enumerate(names):
                advised = tables.where(budget_rows, error=kind, budget_ms=budget, scene=scene)
                for row in advised.itertuples():
                    _row(axis, row_number, row, rows[scene], column)
            axis.set(xscale="log", title=f"within {budget:g} ms", xlabel=f"{NAMES[kind]} [% of peak]")
            axis.grid(axis="y", visible=False)
        least_x, largest_x = line[0].get_xlim()
        line[0].set_xlim(least_x / 4, largest_x * 4)  # room for the names beside the points
        for axis in line:
            _truth(axis, rows, column)
            style.plain_log(axis.xaxis)
    panels[0, 0].set_yticks(range(len(names)), [spaced(scene) for scene in names])
    panels[0, 0].set_ylim(len(names) - 0.4, -0.75)
    handles = [
        Line2D([], [], marker="o", color=style.INK, label="advised: mean, with 5 to 95 % of draws of the contacts"),
        Line2D([], [], ls="", marker="|", ms=11, mew=1.5, color=style.INK, label="its bound of nine answers in ten"),
        Line2D([], [], ls="", marker="o", mfc="white", mec=style.FAINT, label="next best model"),
        Patch(color=OWN_COLOUR, label="below the error of the truth itself"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(3, len(budgets)))
    return figure


def _truth(axis, rows: dict, column: str) -> None:
    """Shade the errors below the truth's own in each row; rows : the settings of each scene."""
    low = axis.get_xlim()[0]
    for place, settings in enumerate(rows.values()):
        own = 100 * own_error(settings, column)
        if own > low:
            axis.fill_betweenx([place - 0.4, place + 0.4], low, own, color=OWN_COLOUR, lw=0, zorder=0)


def _row(axis, place: int, row, settings, column: str) -> None:
    """Draw what is advised for one scene as a row of a panel: mean, interval and bound, and the next best model.

    place : of the row; row : of advice.csv; settings : the scene's, of ``averaged``; column : of the error
    """
    if row.model == NONE:
        axis.text(0.5, place, "none", transform=axis.get_yaxis_transform(), ha="center", va="center", color="#aa0000")
        return
    shown, error = look(row.model), _error(settings, row.model, row.setting, column)
    if row.factor > 0:
        rival = _error(settings, row.rival, row.rival_setting, column)
        axis.plot([error, rival], [place, place], color="#dddddd", lw=1, zorder=1)
        axis.plot(rival, place, marker=look(row.rival).marker, mfc="white", mec=style.FAINT, ms=6, zorder=2)
        times = f"{float(f'{row.factor:.2g}'):g}×" if row.factor < 1000 else "over 1000×"
        _beside(axis, rival, place, f"{label(row.rival, 'default')}: {times} the bound", -1, "#666666")
    interval = [max(100 * row.error_low, LEAST_PERCENT), max(100 * row.error_high, LEAST_PERCENT)]
    axis.plot(interval, [place, place], color=shown.colour, lw=3, alpha=0.45)
    if row.bound_of_peak > 0:
        axis.plot(max(100 * row.bound_of_peak, LEAST_PERCENT), place, "|", color=shown.colour, ms=11, mew=1.5, zorder=3)
    size = 11 if shown.marker == "*" else 7
    axis.plot(error, place, marker=shown.marker, color=shown.colour, mec="white", mew=0.5, ms=size, zorder=3)
    _beside(axis, error, place, label(row.model, "default"), 1, shown.colour)


def _error(settings, model: str, setting: str, column: str) -> float:
    """Return the error of a setting in %, at least LEAST_PERCENT, where nearly exact answers are drawn."""
    return max(100 * tables.where(settings, model=model, setting=setting)[column].iloc[0], LEAST_PERCENT)


def _beside(axis, x: float, place: int, text: str, side: int, colour: str) -> None:
    """Draw a name above (1) or below (-1) its point."""
    aligned = {"ha": "center", "va": "bottom" if side > 0 else "top", "fontsize": 7, "color": colour}
    axis.annotate(text, (x, place), (0, 8 * side), textcoords="offset points", **aligned)


FORCE = "depth: the force"
"""The last column: the error of the force on a disc that is pushed to a depth."""


@style.figure("any_load", tables=("any_load",))
def draw_any_load(any_load) -> Figure:
    """Draw the error of every setting over its time; a row per scene, a column for each kind of load, and the force.

    Settings that answered all loads are full, others hollow. Models that refuse all of a kind are named in its panel.
    """
    scenes, columns = tables.scenes(any_load), [*LOADS, FORCE]
    size = (2.75 * len(columns), 0.9 + 2.5 * len(scenes))
    figure, panels = style.panels(len(scenes), len(columns), size, sharex=True, sharey=True)
    hollow = any_load["refused"] + any_load["doubted"] + any_load["failures"] > 0
    for row, scene in zip(panels, scenes, strict=True):
        for axis, column in zip(row, columns, strict=True):
            kind, error = (DEPTH, "force_error") if column == FORCE else (column, "rmse_of_peak")
            rows = tables.where(any_load, scene=scene, kind=kind)
            curves(axis, points(rows, "online_median_s", error, hollow=hollow[rows.index]))
            _refusals(axis, rows)
            axis.set_title(column)
        row[0].set_ylabel(f"{spaced(scene)}\nerror, RMSE [% of peak]")
    for axis in panels[-1]:
        axis.set_xlabel("time of an answer [ms]")
    finish(panels.ravel(), {})
    shown = handles(points(any_load, "online_median_s", "rmse_of_peak"))
    figure.legend(handles=shown, loc="outside lower center", ncols=5)
    return figure


def _refusals(axis, rows: pd.DataFrame) -> None:
    """Name the models that refuse all loads of a panel."""
    every = (rows["refused"] == rows["samples"]).groupby(rows["model"], sort=False).all()
    if every.any():
        names = [label(str(name), "default") for name in every.index[every]]
        looks: dict = {"transform": axis.transAxes, "va": "bottom", "fontsize": 6.5, "color": "#777777"}
        axis.text(0.02, 0.02, "\n".join(["refused by", *names]), **looks)


ANSWERS = np.geomspace(1, 1e6, 61)
DASHES = ("-", "--", ":", "-.")
"""Line styles, one for each setting of a model."""
WIDE = 64
"""Letters in a line of the legend, about as wide as a panel."""


@style.figure("break_even", tables=("accuracy_vs_time", "advice"))
def draw_break_even(accuracy_vs_time, advice) -> Figure:
    """Draw the time of preparation and answers together, for every setting advised by RMSE; a panel per scene."""
    names, advice = tables.scenes(accuracy_vs_time), tables.where(advice, error="rms")
    advised_of = {
        scene: advised(tables.where(accuracy_vs_time, scene=scene), tables.where(advice, scene=scene))
        for scene in names
    }
    legends = {scene: [_named(row) for row in rows.itertuples()] for scene, rows in advised_of.items()}
    most_lines = max("\n".join(texts).count("\n") + 1 for texts in legends.values())
    figure, axes = style.panel_each(names, 2, 5, 2.8 + 0.15 * most_lines)
    for scene, axis in axes.items():
        drawn: list[str] = []
        for row, text in zip(advised_of[scene].itertuples(), legends[scene], strict=True):
            shown = look(row.model)
            total = row.offline_s + ANSWERS * row.online_median_s
            axis.loglog(ANSWERS, total, DASHES[drawn.count(row.model) % 4], color=shown.colour, label=text, zorder=2)
            drawn.append(row.model)
            if ANSWERS[0] <= row.break_even_queries <= ANSWERS[-1]:
                time_then = row.offline_s + row.break_even_queries * row.online_median_s
                axis.plot(row.break_even_queries, time_then, "o", color=shown.colour, mec="white", ms=6, zorder=3)
        axis.set(title=spaced(scene), xlabel="answers", ylabel="preparation and answers [s]")
        axis.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0, -0.17), borderaxespad=0)  # no line is hidden
        style.plain_log(axis.xaxis, axis.yaxis)
    return figure


def _named(row) -> str:
    return fill(f"{label(row.model, row.setting)}, {percent(row.rmse_of_peak)}", WIDE)


def advised(settings, advice):
    """Select the settings of one scene that are advised for any limit, and the least wrong one; least wrong first."""
    means = answers(averaged(settings))
    usable = means[means["failures"] == 0].set_index(["model", "setting"], drop=False)
    taken = {*zip(advice["model"], advice["setting"], strict=True), pick(usable, BY_ERROR).name}
    return usable[usable.index.isin(taken)].sort_values("rmse_of_peak")
