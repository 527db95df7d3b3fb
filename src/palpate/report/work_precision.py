"""Draw error against time in one way: curves of models, fronts, the truth's own error, limits of time, the legend."""

from collections.abc import Iterable, Mapping
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from palpate.benchmark.model import LIMIT
from palpate.benchmark.ranking import EXACT, ZERO, front
from palpate.report import style
from palpate.report.model_looks import Look, look
from palpate.report.words import percent

FRAMES_MS = (1.0, 16.7, 100.0)
"""Times of an answer: of haptics, of 60 pictures a second, of an immediate reaction."""
LEAST_PERCENT = 100 * EXACT
"""Errors [%] below this are drawn at it."""
LINES: dict[str, Any] = {"load": "-", "deformation": (0, (4, 2)), LIMIT: (0, (6, 1.5, 1, 1.5)), "": ""}
"""Lines of models that know the load, of those that see a deformation, and of settings for ever finer meshes."""
STRIP = 0.15
"""Share of a panel's height that is left free below all points, for two lines of words."""
SIZES = {"*": 10, "P": 7.5, "X": 7.5}
"""Of markers that look smaller than others."""
OWN_COLOUR = "#ececec"
WORDS: dict[str, Any] = {"fontsize": 7.5, "textcoords": "offset points"}


def points(rows: pd.DataFrame, time: str, error: str, factor: float = 1e3, **more: Any) -> pd.DataFrame:
    """Return settings as the diagram takes them: ``time``, times ``factor``, and ``error``, a share, in per cent.

    more : one value or one for each row: ``curve`` that has the look (the model's, if not given), ``line`` of LINES,
    ``part`` of a curve that is joined by itself, ``marker`` in the place of the look's, ``hollow`` (it failed
    somewhere), ``prepared`` (a black rim), and ``low`` and ``high`` [share], the ends of a band
    A setting without a time or an error is left out.
    """
    settings = pd.DataFrame(
        {"model": rows["model"], "time": factor * rows[time], "error": rows[error]}, index=rows.index
    )
    defaults = {"curve": rows["model"], "line": "load", "part": "", "marker": "", "hollow": False, "prepared": False}
    settings = settings.assign(**defaults | more)
    for name in {"error", "low", "high"} & set(settings):
        settings[name] = np.maximum(100 * settings[name], LEAST_PERCENT)
    return settings[np.isfinite(settings[["time", "error"]]).all(axis=1)]


def curves(axis: Axes, drawn: pd.DataFrame) -> None:
    """Draw points, and for each curve a line through those of its points that no other beats in time and error.

    Where several models share a curve, such as variants of one method, only the points on the line are drawn.
    """
    axis.set(xscale="log", yscale="log")
    for (curve, line, _, marker), group in drawn.groupby(["curve", "line", "part", "marker"], sort=False):
        shown = look(str(curve))
        best = group.iloc[front(group["time"], group["error"])]
        axis.plot(best["time"], best["error"], color=shown.colour, ls=LINES[line], lw=1.4, zorder=2)
        if "low" in best:
            band = best["time"], best["low"], best["high"]
            axis.fill_between(*band, color=shown.colour, alpha=0.15, lw=0, zorder=1)
            axis.vlines(*band, color=shown.colour, lw=0.8, alpha=0.6, zorder=2)
        marked = best if group["model"].nunique() > 1 else group
        for (hollow, prepared), same_look in marked.groupby(["hollow", "prepared"], sort=False):
            drawn_as = mark(shown, str(marker), bool(hollow), bool(prepared))
            axis.plot(same_look["time"], same_look["error"], ls="", zorder=3, **drawn_as)
        if line == LIMIT:
            axis.plot(marked["time"], marked["error"], ".", color="white", ms=3.5, mew=0, zorder=4)


def mark(shown: Look, marker: str = "", hollow: bool = False, prepared: bool = False) -> dict[str, Any]:
    """Return how a marker is drawn; ``marker`` stands in the place of the look's."""
    marker, face = marker or shown.marker, "white" if hollow else shown.colour
    rim = "black" if prepared else "white"
    rim = shown.colour if hollow or marker not in Line2D.filled_markers else rim
    sizes = {"ms": SIZES.get(marker, 6.5), "mew": 0.6 if rim == "white" else 0.9}
    return {"marker": marker, "color": shown.colour, "mfc": face, "mec": rim} | sizes


def steps(axis: Axes, drawn: pd.DataFrame, colour: str = style.INK, zorder: int = 1) -> None:
    """Draw the Pareto front of points as steps up to the edge of the panel, which gets no wider from here on."""
    best, (left, right) = drawn.iloc[front(drawn["time"], drawn["error"])], axis.get_xlim()
    corners = [*best["time"], right], [*best["error"], *best["error"][-1:]]
    axis.plot(*corners, color=colour, lw=0.9, drawstyle="steps-post", zorder=zorder)
    axis.set_xlim(left, right)


def own_error(axis: Axes, own: float, of: str = "truth", known: float = np.inf, unknown: str = "") -> None:
    """Shade errors below the truth's own error, in which models are tied, under all points, and say so in a note.

    own : error [share] of the truth, or of the reference that ``of`` names, NaN where it is not known;
    known : the largest own error that is small enough; unknown : the note where ``own`` is NaN
    """
    bottom, top = axis.get_ylim()
    if axis.get_autoscaley_on():  # once for panels that share an axis
        bottom = bottom * (bottom / top) ** STRIP
    axis.set_ylim(np.fmin(bottom, 50 * own), None)
    text, colour = f"grey: below the error of the {of} itself, {percent(own)}", "#555555"
    if not own <= known:
        own_percent = percent(own) if percent(own) != percent(known) else f"{100 * own:.3g}\u00a0%"
        text = f"The {of} is known to {own_percent} only, not to {percent(known)} (grey: models are tied)"
        colour = look(ZERO).colour
    if np.isfinite(own):
        axis.axhspan(1e-3 * LEAST_PERCENT, 100 * own, color=OWN_COLOUR, zorder=0)
    else:
        text = unknown or f"the error of the {of} itself is not known"
    if (place := axis.get_subplotspec()) is not None:  # a panel, and no picture for narrow screens
        text = fill(text, 88 if place.get_gridspec().ncols < 3 else 55)
        note = axis.annotate(text, (0, 0), (4, 4), xycoords="axes fraction", color=colour, zorder=5, **WORDS)
        note.set_in_layout(False)


def nothing(axis: Axes, wrong: float) -> None:
    """Draw a line at ``wrong``, the error [share] of no displacement, above which a model is worse than no answer."""
    if not wrong > 0:
        return
    axis.set_ylim(None, max(axis.get_ylim()[1], 140 * wrong))
    colour = look(ZERO).colour
    axis.axhline(100 * wrong, color=colour, lw=1, ls=(0, (1, 1.5)), zorder=1)
    if axis.get_subplotspec() is not None:
        place: dict = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom"}
        axis.annotate(f"no displacement at all: {percent(wrong)}", (1, 100 * wrong), (-3, 2), color=colour, **place,
                      **WORDS)  # fmt: skip


def limits(axis: Axes, named: Mapping[float, str], inside: bool = False) -> None:
    """Draw limits of time in a panel, and their names above it, or upright ``inside`` at its lower edge."""
    left, right = axis.get_xlim()
    aligned: dict = {"ha": "right", "va": "bottom", "rotation": 90} if inside else {"ha": "center", "va": "bottom"}
    height, shift = (0, (-1.5, 3)) if inside else (1, (0, 3))
    for time, name in named.items():
        if left < time < right:
            axis.axvline(time, color="#b5b5b5", ls=":", lw=1, zorder=1)
            axis.annotate(
                name, (time, height), shift, xycoords=("data", "axes fraction"), color="#444444", **aligned, **WORDS
            )


def frames(times_ms: Iterable[float] = FRAMES_MS) -> dict[float, str]:
    """Return the names of limits of time [ms]."""
    return {time: f"{time:g} ms" for time in times_ms}


def panels(axes: list[Axes], drawn: Iterable[pd.DataFrame], owns: Iterable[float], named: Mapping[float, str]) -> None:
    """Draw in each panel its table of points, its truth's error of ``owns`` [share], and the ``named`` limits [ms]."""
    for axis, group in zip(axes, drawn, strict=True):
        curves(axis, group)
    for axis, own in zip(axes, owns, strict=True):
        own_error(axis, own)
    finish(axes, named)


def finish(axes: Iterable[Axes], named: Mapping[float, str], inside: bool = False) -> None:
    """Label the axes of panels, and draw limits of time in all of them."""
    for axis in axes:
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
        limits(axis, named, inside)


def handles(drawn: pd.DataFrame, marks: Mapping[str, str] | None = None, lines: bool = True) -> list[Line2D]:
    """Return a handle for each curve, with its line, and for the meanings of ``marks`` by their markers.

    A curve whose points all have markers of their own is a line.
    """
    entries = []
    for curve, group in drawn.groupby("curve", sort=False):
        looks = mark(shown := look(str(curve)), prepared=bool(group["prepared"].all())) | {"lw": 1.3 if lines else 0.0}
        if (group["marker"] != "").all():
            looks = {"color": shown.colour, "lw": 3}
        entries.append(Line2D([], [], ls=LINES[group["line"].iloc[0]] or "-", label=shown.label, **looks))
    for marker, meaning in (marks or {}).items():
        entries.append(Line2D([], [], label=meaning, ls="", **mark(Look("", "#777777", marker))))
    return entries


def meanings(prepared: str, failed: str) -> list[Line2D]:
    """Return the handles of a black rim and of a hollow marker."""
    grey: dict = {"ls": "", "marker": "o", "ms": 7}
    return [
        Line2D([], [], **grey, mfc="#bbbbbb", mec="black", mew=0.9, label=prepared),
        Line2D([], [], **grey, mfc="white", mec="#888888", label=failed),
    ]


def legend(axis: Axes, shown: list[Line2D], words: str, failed: bool = False, ncols: int = 5, width: int = 190) -> None:
    """Fill the axis below all panels: the legend, and words about what has no point, in red if something ``failed``.

    width : of a line of words [letters]
    """
    axis.set_axis_off()
    looks: dict = {"fontsize": 7.5, "borderaxespad": 0, "handlelength": 2.3, "columnspacing": 1.1}
    axis.legend(handles=shown, loc="upper left", ncols=ncols, **looks).set_in_layout(False)  # panels stay as wide
    colour = "#aa0000" if failed else "#666666"
    text = fill(words, width)
    axis.text(0, 0, text, transform=axis.transAxes, va="bottom", fontsize=7.5, color=colour)
