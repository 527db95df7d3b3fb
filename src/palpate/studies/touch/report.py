"""What the report shows of touches: their figure, names, and what to take within each time."""

from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from palpate.benchmark.advice import choice, touches
from palpate.benchmark.choosing import NONE, Limit
from palpate.benchmark.ranking import TRUTH
from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import seconds, spaced
from palpate.report.work_precision import FRAMES_MS, frames, handles, legend, meanings, panels, points

READS = ("touch",)
"""Tables of benchmark/ that the template shows."""
SHARES = {
    "force [%]": "force_error",
    "limit [%]": "limit",
    "surface [% of peak]": "rmse_of_peak",
    "dent [% of peak]": "patch_rms_of_peak",
}
"""What is told of a setting that is taken, in per cent."""
PANELS = {
    "rmse_of_peak": "error over the surface, RMSE [% of peak]",
    "patch_rms_of_peak": "error in the dent, RMS [% of peak]",
    "force_error_size": "error of the force [%]",
}
"""The errors that are drawn, a panel each."""
FORCE = "force_error_size"
FELT = (0.07, 0.10)
"""Differential threshold of force: shares by which two forces differ that a hand just tells apart (Jones 1989; Pang,
Tan and Durlach 1991)."""
FELT_COLOUR = "#fbe3c4"
_MESHES = {"order=1": "fem_p1", "order=2": "fem_p2", "held=": "fem_local"}
"""How settings of finite elements begin, which are three curves, and the models whose looks these have."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    touch, truth = report.tables["touch"], report.tables["touch_truth"]
    titles = {str(scene): title_of(rows) for scene, rows in truth.groupby("scene", sort=False)}
    return {
        "touch": touch.assign(words=[named(row.model, row.setting) for row in touch.itertuples()]),
        "titles": titles,
        "felt": FELT,
        "taken": {scene: _taken(tables.where(touch, scene=scene)) for scene in titles},
        "touch_truth": truth.assign(title=truth["scene"].map(titles)),
    }


def _taken(touch: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what is nearest to the true force within each time."""
    rows = []
    for limit in (*map(Limit, FRAMES_MS), Limit()):
        row: dict[str, Any] = {"within": f"{limit.budget_ms:g}\u00a0ms" if limit.time else "any time"}
        advised = choice(touches(touch), limit)
        if advised["model"] == NONE:
            fastest = f"fastest: {seconds(advised['nearest_s'])}" if advised["nearest_s"] > 0 else advised["why"]
            row |= {"take": NONE, "setting": fastest}
        else:
            prepared_s = advised["preparation_s"]
            row |= {"take": look(curve_of(advised["model"], advised["setting"])).label, "setting": advised["setting"]}
            row |= {name: 100 * advised[column] for name, column in SHARES.items()}
            row |= {"median": seconds(advised["online_median_s"]), "slowest touch": seconds(advised["online_max_s"])}
            row |= {"place prepared in": seconds(prepared_s) if prepared_s > 1e-4 else "–"}
        rows.append(row)
    names = dict.fromkeys(name for row in rows for name in row)
    return pd.DataFrame([{name: row.get(name, "–") for name in names} for row in rows])


def answers(touch: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of models, which the truth is not."""
    return touch[touch["model"] != TRUTH]


def curve_of(model: str, setting: str) -> str:
    """Return whose look a setting has: that of its model, of finite elements that of their order or their mesh."""
    if model != "fem":
        return model
    return next((name for start, name in _MESHES.items() if setting.startswith(start)), model)


@style.figure("touch_precision", tables=("touch",))
def draw_touch_precision(touch, *, scene: str) -> Figure:
    """Draw the errors of all models in one ``scene``, a panel for each kind of error, and a curve for each model.

    A setting that failed on some touches is hollow; what failed on all, and what tells no force, is named below.
    """
    rows = tables.where(touch, scene=scene)
    shown = answers(rows)
    looks = {"curve": [curve_of(*each) for each in _settings(shown)], "hollow": shown["failures"] > 0}
    looks |= {"prepared": shown["prepared"].astype(bool)}
    drawn_points = [points(shown, "online_median_s", column, **looks) for column in PANELS]
    figure = Figure(figsize=(12.5, 5.9), layout="constrained")
    parts = figure.subplot_mosaic([list(PANELS), ["legend"] * len(PANELS)], height_ratios=[4.6, 0.9])
    axes = [parts[column] for column in PANELS]
    for axis, name in zip(axes, PANELS.values(), strict=True):
        axis.set(xlabel="time of an answer [ms]", ylabel=name)
    _felt(parts[FORCE])
    panels(axes, drawn_points, tables.where(rows, model=TRUTH)[list(PANELS)].mean(), frames())
    axes[0].set_title(title_of(rows), pad=18)
    all_points = pd.concat(drawn_points, ignore_index=True)
    shown_as = [*handles(all_points), *meanings("place prepared before", "failed on some touches")]
    failed = shown[shown["failures"] > 0]
    names = [f"{named(row.model, row.setting)} on {row.failures} of {row.samples}" for row in failed.itertuples()]
    words = f"failed: {', '.join(names)}" if names else "no setting failed on any touch"
    legend(parts["legend"], shown_as, words + _mute(shown), failed=len(failed) > 0)
    return figure


def _felt(axis) -> None:
    """Draw by how much forces differ that a hand just tells apart."""
    axis.axhspan(*(100 * share for share in FELT), color=FELT_COLOUR, zorder=0)
    place: dict = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "bottom"}
    text = f"a hand just tells {100 * FELT[0]:g} to {100 * FELT[1]:g} % apart"
    axis.annotate(text, (0, 100 * FELT[1]), (4, 2), fontsize=7.5, color="#8a5a00", **place)


def _mute(shown: pd.DataFrame) -> str:
    """Name the models that answer and tell no force."""
    forces = shown[shown["failures"] < shown["samples"]].groupby("model", sort=False)[FORCE].count()
    mute = [look(str(model)).label for model in forces.index[forces == 0]]
    return f"; no force is told by: {', '.join(mute)}" if mute else ""


def title_of(rows: pd.DataFrame) -> str:
    """Name the scene of ``rows``: "liver under a sphere of 8 mm"."""
    row = rows.iloc[0]
    return f"{spaced(row['body'])} under a {row['instrument']} of {1e3 * row['radius_m']:g} mm"


def _settings(rows: pd.DataFrame):
    return rows[["model", "setting"]].itertuples(index=False, name=None)


def named(model: str, setting: str) -> str:
    """Name a setting in words."""
    return f"{look(curve_of(model, setting)).label} ({setting})"
