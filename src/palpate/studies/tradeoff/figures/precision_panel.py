"""Draw one panel of the work–precision diagram: one kind of error against time, for one scene."""

from textwrap import fill

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import EXACT
from palpate.report import style
from palpate.report.model_looks import look
from palpate.report.number_format import percent
from palpate.report.pareto import front
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, ZERO, answers, curves, front_rows, own_errors

LEAST = 100 * EXACT
"""Errors [% of the peak] below this are drawn at it."""
STRIP = 0.09
"""Share of a panel's height that is left free below all points, for two lines of words."""
WIDTH = 88
"""Letters in a line of small text that is as wide as a panel."""
_CORNERS = ((-1, -1), (1, 1), (1, -1), (-1, 1))
"""Where the number of a point stands, in turn for points that are near each other."""


def panel(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the error ``column`` of every model of one scene, its front, the truth's own error and the zero answer.

    settings : rows as ``scene_rows.averaged`` gives them
    """
    axis.set(xscale="log", yscale="log", xlabel="online time of an answer [ms]")
    for model, rows in curves(answers(settings)).items():
        _curve(axis, model, rows, column)
    _front(axis, settings, column)
    _zero(axis, settings, column)
    _truth(axis, *own_errors(settings, column))


def milliseconds_and_percent(rows: pd.DataFrame, column: str = "rmse_of_peak") -> tuple[np.ndarray, np.ndarray]:
    """Return where settings are drawn: their median time [ms] and their error [% of the peak]."""
    return 1e3 * rows["online_median_s"].to_numpy(), np.maximum(100 * rows[column].to_numpy(), LEAST)


def line_style(rows: pd.DataFrame) -> str | tuple[int, tuple[int, int]]:
    """Return the line of a model that knows the load, or of one that sees a coarse deformation only."""
    return "-" if (rows["sees"] == "load").all() else (0, (4, 2))


def rim(prepared: bool) -> tuple[str, float]:
    """Return the colour and width of the rim of a marker: black where contacts were prepared."""
    return ("black", 0.9) if prepared else ("white", 0.5)


def _curve(axis, model: str, rows: pd.DataFrame, column: str) -> None:
    """Draw a model's settings, or of variants the front, a line through it, and a band over the splits around that."""
    t, error = milliseconds_and_percent(rows, column)
    shown, best = look(model), front(t, error)
    axis.plot(t[best], error[best], color=shown.colour, ls=line_style(rows), lw=1.4, zorder=2)
    if rows["splits"].max() > 1:
        low, high = (np.maximum(100 * rows[f"{column}_{end}"].to_numpy()[best], LEAST) for end in ("low", "high"))
        axis.fill_between(t[best], low, high, color=shown.colour, alpha=0.15, lw=0, zorder=1)
        axis.vlines(t[best], low, high, color=shown.colour, lw=0.8, alpha=0.6, zorder=2)
    size = 10 if shown.marker == "*" else 6.5
    for i in best if rows["model"].nunique() > 1 else range(len(rows)):
        failed, (edge, width) = rows["failures"].iloc[i] > 0, rim(rows["prepared"].iloc[i])
        inside, around = ("white", shown.colour) if failed else (shown.colour, edge)
        axis.plot(
            t[i], error[i], ls="", marker=shown.marker, color=inside, mec=around, mew=1 if failed else width, ms=size,
            zorder=3,
        )  # fmt: skip
    if model.startswith("fem_p"):
        _levels(axis, rows, column)


def _levels(axis, rows: pd.DataFrame, column: str) -> None:
    """Join the front of each level of a finite-element model, and write the level at its end."""
    t, error = milliseconds_and_percent(rows, column)
    colour = look(rows["model"].iloc[0]).colour
    levels = rows["setting"].str.extract(r"level=(\d+)", expand=False).to_numpy()
    for level in sorted(set(levels[~pd.isna(levels)])):
        own = np.flatnonzero(levels == level)
        own = own[front(t[own], np.round(np.log(error[own]), 2))]
        axis.plot(t[own], error[own], color=colour, lw=0.6, alpha=0.6, zorder=1)
        place = (t[own[-1]], error[own[-1]])
        axis.annotate(f"L{level}", place, (2, 4), textcoords="offset points", fontsize=7, color=colour, zorder=4)


def _front(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the steps of this run's front, and a number at each point that is on it in other runs too."""
    whole = answers(settings)
    whole = whole[whole["failures"] == 0]
    t, error = milliseconds_and_percent(whole, column)
    best = front(t, whole[column])
    ends = [*t[best], axis.get_xlim()[1]]
    axis.plot(ends, [*error[best], error[best][-1]], color=style.INK, lw=0.9, drawstyle="steps-post", zorder=1)
    before: list[np.ndarray] = []
    for number, (_, row) in enumerate(front_rows(settings, column).iterrows(), start=1):
        place = (1e3 * row["online_median_s"], max(100 * row[column], LEAST))
        axis.plot(*place, "o", mfc="none", mec=style.INK, mew=0.9, ms=14, zorder=4)
        near = sum(bool((np.abs(np.log(place) - other) < np.log((1.5, 1.25))).all()) for other in before)
        before.append(np.log(place))
        x, y = _CORNERS[near % len(_CORNERS)]
        axis.annotate(
            str(number), place, (9 * x, 9 * y), textcoords="offset points", ha="right" if x < 0 else "left",
            va="top" if y < 0 else "bottom", fontsize=8, fontweight="bold", color=style.INK, zorder=5,
        )  # fmt: skip


def _zero(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the error of the zero answer, above which a model is worse than nothing."""
    wrong = settings.loc[settings["model"] == ZERO, column].mean()
    if np.isfinite(wrong):
        axis.set_ylim(None, max(axis.get_ylim()[1], 140 * wrong))
        axis.axhline(100 * wrong, color=look(ZERO).colour, lw=1, ls=(0, (1, 1.5)), zorder=1)
        axis.annotate(
            f"no displacement at all: {percent(wrong)}", (1, 100 * wrong), (-3, 2),
            xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="bottom", fontsize=7.5,
            color=look(ZERO).colour,
        )  # fmt: skip


def _truth(axis, tested: float, chosen: float) -> None:
    """Draw the truth's own error as a band, up to the larger of those on test and validation samples."""
    own = np.fmax(tested, chosen)
    if not np.isfinite(own):
        text, colour = "the error of the truth itself is not known", look(ZERO).colour
    else:
        # no point or line where the words are
        least, most = axis.get_ylim()
        low = min(least * (least / most) ** STRIP, 50 * own)
        axis.set_ylim(low, None)
        axis.axhspan(low, 100 * own, color="#ececec", zorder=0)
        where = f" on validation contacts ({percent(tested)} on test contacts)" if chosen > tested else ""
        text, colour = f"grey: below the error of the truth itself, {percent(own)}{where}; models are tied", "#555555"
        if own > KNOWN:
            text = f"The truth is known to {percent(own)} only{where}, not to {percent(KNOWN)} (grey: models are tied)"
            colour = look(ZERO).colour
    axis.annotate(
        fill(text, WIDTH), (0, 0), (4, 4), xycoords="axes fraction", textcoords="offset points", fontsize=7.5,
        color=colour, zorder=5,
    ).set_in_layout(False)  # fmt: skip
