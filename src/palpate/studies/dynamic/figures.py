"""Draw errors of motion over their cost, and up to when references are resolved, a panel for each scene."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.advice import QUADRATIC
from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.report.words import spaced
from palpate.report.work_precision import curves, finish, handles, own_error, points
from palpate.studies.dynamic.forces import LIMIT

VARIED = {
    "tolerance": ("x", "looser residual"),
    "gap": ("+", "another gap of contact"),
    "order": ("1", "steps of first order"),
    "place": ("2", "modes for another place"),
}
"""Markers and meanings of settings that differ from the others of their model in more than the step."""


@style.figure("dynamic_accuracy", tables=("dynamic_accuracy",))
def draw_dynamic_accuracy(dynamic_accuracy) -> Figure:
    """Draw error over computing time of a second of motion, a panel a scene and a curve a model.

    Settings that did not converge are counted in the panel's title.
    """
    table = dynamic_accuracy[dynamic_accuracy["failures"] == 0]
    varied = table["varied"].where(table["varied"].isin(VARIED), "")
    looks = {"marker": varied.map(lambda name: VARIED[name][0] if name else "")}
    # settings that differ in more than the step have a marker of their own, and no line
    looks["line"] = looks["marker"].map(lambda marker: "" if marker else "load")
    drawn = points(table, "real_time_factor", "rmse_of_peak", 1.0, part=table["level"], **looks)
    figure, axes = style.panel_each(tables.scenes(dynamic_accuracy), 4, 3.4, 3.6, "RMSE [% of peak]", sharey=True)
    for scene, axis in axes.items():
        curves(axis, drawn[table.loc[drawn.index, "scene"] == scene])
        failed = int(tables.where(dynamic_accuracy, scene=scene)["failures"].sum())
        axis.set_xlabel("seconds for a second of motion")
        axis.set_title(spaced(scene) + (f", {failed} did not converge" if failed else ""), pad=18)
        low, high = axis.get_xlim()
        axis.set_xlim(min(low, 0.8), max(high, 1.25))  # real time is seen
    for scene, axis in axes.items():
        first_row = tables.where(dynamic_accuracy, scene=scene).iloc[0]
        is_truth = first_row["reference"] == QUADRATIC
        what = "truth" if is_truth else f"standard on level {first_row['reference_level']:g}"
        own_error(axis, first_row["reference_error"], what)
    finish(axes.values(), {1.0: "real time"})
    legend_handles = handles(drawn, dict(VARIED[name] for name in VARIED if name in set(varied)))
    sizes = {"ncols": min(4, len(axes) + 1), "fontsize": 7, "columnspacing": 1, "handlelength": 1.5}
    figure.legend(handles=legend_handles, loc="outside upper center", **sizes)
    return figure


@style.figure("dynamic_force", tables=("dynamic_accuracy", "dynamic_force"))
def draw_dynamic_force(dynamic_accuracy, dynamic_force) -> Figure:
    """Draw one panel for each scene in which something touches: what instruments feel over time, all of them together.

    Of each model that setting is drawn whose force is nearest to the truth or the standard, which is the wide line.
    """
    table = dynamic_force
    figure, axes = style.panel_each(tables.scenes(table), 4, 3.4, 3.0, "force of the instruments [N]")
    drawn = {}
    for scene, axis in axes.items():
        of_scene = tables.where(table, scene=scene)
        true = tables.where(of_scene, setting=LIMIT)
        axis.plot(*_felt(true), color=style.FAINT, lw=6, solid_capstyle="round")
        with_force = tables.where(dynamic_accuracy, scene=scene).dropna(subset="force_rms_of_peak")
        for model, rows in with_force.groupby("model", sort=False):
            best, shown = rows.loc[rows["force_rms_of_peak"].idxmin()], look(model)
            drawn[model] = shown
            axis.plot(*_felt(tables.where(of_scene, model=model, setting=best["setting"])), color=shown.colour, lw=1.2)
        axis.set_xlabel("time [s]")
        axis.set_title(spaced(scene))
        axis.set_ylim(bottom=0.0)
    handles = [Line2D([], [], color=style.FAINT, lw=6, label="the truth or the standard")]
    handles += [Line2D([], [], color=shown.colour, label=shown.label) for shown in drawn.values()]
    figure.legend(handles=handles, loc="outside upper center", ncols=min(4, len(axes) + 1))
    return figure


def _felt(curve: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles of frames [s] and the size of the force on each instrument, added up [N]."""
    sizes = np.linalg.norm(curve[["force_x_n", "force_y_n", "force_z_n"]], axis=1)
    whole = pd.Series(sizes).groupby(curve["time_s"].to_numpy()).sum()
    ends = whole.index.to_numpy()
    return ends - 0.5 * np.diff(ends, prepend=0.0), whole.to_numpy()


@style.figure("dynamic_reference", tables=("dynamic_reference",))
def draw_dynamic_reference(dynamic_reference) -> Figure:
    """Draw one panel for each scene, a line for each step; frames in which models are not compared are shaded."""
    table = dynamic_reference
    figure, axes = style.panel_each(tables.scenes(table), 4, 3.4, 2.6, "change [% of peak]", sharey=True)
    for scene, axis in axes.items():
        rows = tables.where(table, scene=scene)
        steps = sorted(set(rows["step_s"]), reverse=True)
        for number, step in enumerate(steps, start=1):
            line = tables.where(rows, step_s=step)
            colour = matplotlib.colormaps["viridis_r"](number / len(steps))
            axis.plot(line["time_s"], 100 * line["change_of_peak"], color=colour, label=f"{1e3 * step:.2g} ms")
        axis.axhline(100 * rows["bound"].iloc[0], color=style.FAINT, ls=":", lw=1)
        until, end = rows.loc[rows["resolved"].astype(bool), "time_s"].max(), rows["time_s"].max()
        if until < end:
            axis.axvspan(until, end, color="#eeeeee", lw=0)
        axis.set(yscale="log", xlabel="time [s]")
        axis.set_title(spaced(scene))
        axis.legend(title="step", loc="lower right", fontsize=7, title_fontsize=7)
    for axis in axes.values():
        axis.set_ylim(bottom=0.01)  # before the first contact, or in free fall, nothing changes
        style.plain_log(axis.yaxis)
    return figure
