"""Error of motion over its cost: a work–precision diagram for each scene, a curve for each model over its step."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.studies.dynamic.figures.panels import panels

TABLES = ("dynamic_accuracy",)
VARIED = {"tolerance": "x", "gap": "+", "order": "1", "place": "2"}
"""Markers of settings that differ from the others of their model in more than the step."""
MEANINGS = {"tolerance": "looser residual", "gap": "another gap of contact"}
MEANINGS |= {"order": "steps of first order", "place": "modes for another place"}


@style.styled
def draw(dynamic_accuracy) -> Figure:
    """Draw one panel for each scene; settings that did not converge are counted in the panel's title.

    dynamic_accuracy : the table of this name
    """
    table = dynamic_accuracy
    models = list(dict.fromkeys(table["model"]))
    figure, axes = panels(tables.scenes(table), 3.6, "RMSE [% of peak]")
    for scene, axis in axes.items():
        rows = tables.where(table, scene=scene)
        for model in models:
            _curve(axis, rows[(rows["model"] == model) & (rows["failures"] == 0)], look(model))
        axis.axvline(1.0, color=style.FAINT, lw=1)
        axis.axhline(100 * rows["reference_change"].iloc[0], color=style.FAINT, ls=":", lw=1)
        failed = int(rows["failures"].sum())
        axis.set(xscale="log", yscale="log", xlabel="seconds for a second of motion")
        axis.set_title(scene.replace("_", " ") + (f", {failed} did not converge" if failed else ""))
        level = f"standard on level {rows['reference_level'].iloc[0]:g}"
        axis.annotate(level, (0.0, 0.0), (3, 3), "axes fraction", "offset points", color=style.INK)
    for axis in axes.values():
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
    handles = [Line2D([], [], color=look(m).colour, marker=look(m).marker, ms=5, label=look(m).label) for m in models]
    there = [name for name in VARIED if name in set(table["varied"])]
    handles += [Line2D([], [], color=style.INK, ls="", marker=VARIED[n], ms=6, label=MEANINGS[n]) for n in there]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def _curve(axis, rows, its) -> None:
    """Draw one model: a line over its steps, and what differs in something else without one."""
    usual = rows[~rows["varied"].isin(VARIED)].sort_values("real_time_factor")
    percents = 100 * usual["rmse_of_peak"]
    axis.plot(usual["real_time_factor"], percents, marker=its.marker, color=its.colour, ms=5, mec="white", mew=0.5)
    for name, marker in VARIED.items():
        other = rows[rows["varied"] == name]
        if len(other):
            percents = 100 * other["rmse_of_peak"]
            axis.plot(other["real_time_factor"], percents, marker=marker, color=its.colour, ls="", ms=6, mew=1.2)
