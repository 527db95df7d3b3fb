"""Draw errors of touches against the time of an answer: over the surface, in the dent, and of the force."""

from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.ranking import EXACT, TRUTH, front
from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.report.words import percent, spaced

PANELS = {
    "rmse_of_peak": "error over the surface, RMSE [% of peak]",
    "patch_rms_of_peak": "error in the dent, RMS [% of peak]",
    "force_error_size": "error of the force [%]",
}
"""The errors that are drawn, a panel each."""
FORCE = "force_error_size"
FRAMES_MS = (1.0, 16.7, 100.0)
"""Times of an answer: of haptics, of 60 pictures a second, of an immediate reaction."""
FELT = (0.07, 0.10)
"""Differential threshold of force: shares by which two forces differ that a hand just tells apart (Jones 1989; Pang,
Tan and Durlach 1991)."""
OWN_COLOUR, FELT_COLOUR = "#ececec", "#fbe3c4"
STRIP = 0.12
"""Share of a panel's height that is left free below all points, for words."""
_MESHES = {"order=1": "fem_p1", "order=2": "fem_p2", "held=": "fem_local"}
"""How settings of finite elements begin, which are three curves, and the models whose looks these have."""


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
    figure = Figure(figsize=(12.5, 5.9), layout="constrained")
    parts = figure.subplot_mosaic([list(PANELS), ["legend"] * len(PANELS)], height_ratios=[4.6, 0.9])
    for column, name in PANELS.items():
        axis = parts[column]
        axis.set(xscale="log", yscale="log", xlabel="time of an answer [ms]", ylabel=name)
        for curve, part in shown.groupby([curve_of(*each) for each in _settings(shown)], sort=False):
            _curve(axis, str(curve), part, column)
        _limits(axis, rows.loc[rows["model"] == TRUTH, column].mean(), column)
    for column in PANELS:
        style.plain_log(parts[column].xaxis)
        style.plain_log(parts[column].yaxis)
        style.frames(parts[column], FRAMES_MS)
    parts["rmse_of_peak"].set_title(title_of(rows), pad=18)
    _legend(parts["legend"], shown)
    return figure


def title_of(rows: pd.DataFrame) -> str:
    """Name the scene of ``rows``: "liver under a sphere of 8 mm"."""
    row = rows.iloc[0]
    return f"{spaced(row['body'])} under a {row['instrument']} of {1e3 * row['radius_m']:g} mm"


def _settings(rows: pd.DataFrame):
    return rows[["model", "setting"]].itertuples(index=False, name=None)


def _curve(axis, curve: str, rows: pd.DataFrame, column: str) -> None:
    """Draw the settings of one curve, a line through those that no other of it beats."""
    rows = rows[np.isfinite(rows[column]) & np.isfinite(rows["online_median_s"])]
    t, error = 1e3 * rows["online_median_s"].to_numpy(), 100 * rows[column].clip(lower=EXACT).to_numpy()
    best, shown = front(t, error), look(curve)
    axis.plot(t[best], error[best], color=shown.colour, lw=1.4, zorder=2)
    for x, y, failed, prepared in zip(t, error, rows["failures"] > 0, rows["prepared"].astype(bool), strict=True):
        inside, edge = ("white", shown.colour) if failed else (shown.colour, "black" if prepared else "white")
        size = 10 if shown.marker == "*" else 6.5
        axis.plot(x, y, ls="", marker=shown.marker, color=inside, mec=edge, mew=0.9, ms=size, zorder=3)


def _limits(axis, own: float, column: str) -> None:
    """Draw below which error models are tied, as the truth is not known better, and of a force what a hand feels."""
    if column == FORCE:
        axis.axhspan(*(100 * share for share in FELT), color=FELT_COLOUR, zorder=0)
        axis.annotate(
            f"a hand just tells {100 * FELT[0]:g} to {100 * FELT[1]:g} % apart", (1, 100 * FELT[1]), (-3, 2),
            xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="bottom", fontsize=7.5,
            color="#8a5a00",
        )  # fmt: skip
    text = "the truth is not known"
    if np.isfinite(own):
        least, most = axis.get_ylim()
        low = min(least * (least / most) ** STRIP, 50 * own)
        axis.set_ylim(low, None)
        axis.axhspan(low, 100 * own, color=OWN_COLOUR, zorder=0)
        text = f"grey: below the error of the truth itself, {percent(own)}"
    axis.annotate(
        text, (0, 0), (4, 4), xycoords="axes fraction", textcoords="offset points", fontsize=7.5, color="#555555"
    )


def _legend(axis, shown: pd.DataFrame) -> None:
    """List the curves; below, the settings that failed, and the models that tell no force."""
    axis.set_axis_off()
    handles = []
    for curve in dict.fromkeys(curve_of(*each) for each in _settings(shown)):
        own = look(curve)
        handles.append(
            Line2D([], [], color=own.colour, marker=own.marker, lw=1.3, ms=6.5, mec="white", label=own.label)
        )
    marked: dict = {"ls": "", "marker": "o", "ms": 7}
    handles += [
        Line2D([], [], **marked, mfc="#bbbbbb", mec="black", mew=0.9, label="place prepared before"),
        Line2D([], [], **marked, mfc="white", mec="#888888", label="failed on some touches"),
    ]
    axis.legend(handles=handles, loc="upper left", ncols=5, fontsize=7.5, borderaxespad=0, columnspacing=1.4)
    failed = [
        f"{named(model, setting)} on {count} of {every}"
        for model, setting, count, every in shown.loc[
            shown["failures"] > 0, ["model", "setting", "failures", "samples"]
        ].itertuples(index=False, name=None)
    ]
    silent = shown.loc[shown["failures"] < shown["samples"]].groupby("model", sort=False)[FORCE].count()
    mute = [look(str(model)).label for model, told in silent.items() if not told]
    words = [f"failed: {', '.join(failed)}" if failed else "no setting failed on any touch"]
    words += [f"no force is told by: {', '.join(mute)}"] if mute else []
    colour = "#aa0000" if failed else "#666666"
    axis.text(0, 0, fill("; ".join(words), 190), transform=axis.transAxes, va="bottom", fontsize=7.5, color=colour)


def named(model: str, setting: str) -> str:
    """Name a setting in words."""
    return f"{look(curve_of(model, setting)).label} ({setting})"
