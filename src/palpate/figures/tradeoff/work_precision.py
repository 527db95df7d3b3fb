"""Draw error against online time of every model at its settings, on one scene: the work–precision diagram."""

from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_reasons import mesh_error
from palpate.evaluation.tradeoff.bootstrap import TRUTH
from palpate.evaluation.tradeoff.equal_settings import EXACT, alone, lasting
from palpate.figures import style, tables
from palpate.figures.model_looks import features, label, look, minor
from palpate.figures.number_format import percent, seconds
from palpate.figures.pareto import front
from palpate.figures.style import Look

TABLES = ("accuracy_vs_time", "advice")
LEAST = 100 * EXACT
"""Errors [% of the peak] below this are drawn at it: the fine model almost equals the reference."""


@style.styled
def draw(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw a curve for each model on one ``scene``, with whiskers to the 95th percentile of the time.

    accuracy_vs_time, advice : the tables of these names
    The stepped line is the front of this run; the numbered points are on it in other runs too. A setting that failed
    on some samples is hollow, and is named below with those that failed on all samples.
    """
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, advice))
    own = mesh_error(settings)
    settings = settings[settings["model"] != TRUTH].reset_index(drop=True)
    figure = Figure(figsize=(10.5, 6.4), layout="constrained")
    axis = figure.subplots()
    axis.set(xscale="log", yscale="log", xlabel="online time of an answer [ms]", ylabel="RMSE [% of peak]")
    for model, rows in settings.groupby("model", sort=False):
        _curve(axis, model, rows)
    _front(axis, settings)
    axis.set_ylim(LEAST / 3 if (settings["rmse_of_peak"] < LEAST / 100).any() else None, None)
    _lines(axis, advice.dropna(subset="budget_ms"), own)
    axis.set_title(f"{settings['body'].iloc[0]}, {settings['regime'].iloc[0]} loads", pad=38)
    style.plain_log(axis.xaxis)
    style.plain_log(axis.yaxis)
    _failures(axis, settings)
    figure.legend(
        handles=_legend(settings),
        loc="outside right upper",
        fontsize=7.5,
        labelspacing=0.35,
        title="lower left is better",
    )
    return figure


def milliseconds_and_percent(rows) -> tuple[np.ndarray, np.ndarray]:
    """Return where settings are drawn: their median time [ms] and their error [% of the peak]."""
    return 1e3 * rows["online_median_s"].to_numpy(), np.maximum(100 * rows["rmse_of_peak"].to_numpy(), LEAST)


def _curve(axis, model: str, rows) -> None:
    """Draw one model's settings, and a line through its own front."""
    t, error = milliseconds_and_percent(rows)
    shown, faint = look(model), minor(model)
    best = front(t, error)
    axis.plot(t[best], error[best], color=shown.colour, lw=0.7 if faint else 1.3, alpha=0.5 if faint else 1, zorder=2)
    late = 1e3 * rows["online_p95_s"].to_numpy()
    axis.hlines(error, t, late, color=shown.colour, lw=0.7, alpha=0.5, zorder=2)
    size = 11 if shown.marker == "*" else 4 if faint else 6.5
    for x, y, failures in zip(t, error, rows["failures"], strict=True):
        inside, rim = ("white", shown.colour) if failures else (shown.colour, "white")
        axis.plot(x, y, marker=shown.marker, color=inside, mec=rim, mew=1 if failures else 0.5, ms=size, zorder=3)


def _front(axis, settings) -> None:
    """Draw the steps of this run's front, and a number at each point that is on it in other runs too."""
    whole = settings[settings["failures"] == 0]
    t, error = milliseconds_and_percent(whole)
    best = front(t, whole["rmse_of_peak"])
    ends = [*t[best], axis.get_xlim()[1]]
    axis.plot(ends, [*error[best], error[best][-1]], color=style.INK, lw=0.9, drawstyle="steps-post", zorder=1)
    for number, row in enumerate(front_rows(settings).itertuples(), start=1):
        place = (1e3 * row.online_median_s, max(100 * row.rmse_of_peak, LEAST))
        axis.plot(*place, "o", mfc="none", mec=style.INK, mew=0.9, ms=14, zorder=4)
        axis.annotate(
            str(number), place, (-9, -9), textcoords="offset points", ha="right", va="top", fontsize=8,
            fontweight="bold", color=style.INK, zorder=5,
        )  # fmt: skip


def front_rows(settings):
    """Select the settings of one scene that stay on the front in other runs, fastest first, one of equal ones."""
    whole = settings[(settings["failures"] == 0) & (settings["model"] != TRUTH)]
    kept = whole[lasting(whole["online_median_s"], whole["rmse_of_peak"])]
    rows = [alone(same) for _, same in kept.groupby("model", sort=False)]
    return pd.concat(rows).sort_values("online_median_s") if rows else kept


def _lines(axis, advice, own) -> None:
    """Draw frame budgets with the advised model for each, and the error of the fine mesh itself."""
    for row in advice.itertuples():
        axis.axvline(row.budget_ms, color="#b5b5b5", ls=":", lw=1, zorder=1)
        advised = NONE if row.model == NONE else label(row.model, "default")
        axis.annotate(
            f"{row.budget_ms:g} ms:\n{fill(advised, 12)}", (row.budget_ms, 1), (0, 3),
            xycoords=("data", "axes fraction"), textcoords="offset points", ha="center", va="bottom", fontsize=7.5,
            color="#444444",
        )  # fmt: skip
    if np.isfinite(own):
        axis.axhspan(axis.get_ylim()[0], 100 * own, color="#f3f3f3", zorder=0)
        axis.annotate(
            f"grey: below the error of the fine mesh itself, {percent(own)}", (0, 0), (4, 4),
            xycoords="axes fraction", textcoords="offset points", fontsize=7.5, color="#666666",
        )  # fmt: skip


def _failures(axis, settings) -> None:
    """Name the settings that failed, below the picture."""
    failed = settings[(settings["failures"] > 0) | ~np.isfinite(settings["rmse_of_peak"])]
    failures = [f"{label(r.model, r.setting)} on {r.failures} of {r.samples}" for r in failed.itertuples()]
    text = "failed: " + ", ".join(failures) if failures else "no setting failed on any sample"
    axis.text(
        0, -0.11, fill(text, 120), transform=axis.transAxes, va="top", fontsize=7.5,
        color="#aa0000" if failures else "#666666",
    )  # fmt: skip


def _legend(settings) -> list[Line2D]:
    """List every model in table order, the blends of paper 1 by their features, then the front and who is on it."""
    handles: list[Line2D] = []
    blends: dict[str, Look] = {}
    for model in dict.fromkeys(settings["model"]):
        shown = look(model)
        if minor(model):
            blends.setdefault(features(model), shown)
            continue
        size = 9 if shown.marker == "*" else 6
        handles.append(
            Line2D([], [], color=shown.colour, marker=shown.marker, ms=size, lw=1, mec="white", label=shown.label)
        )
    handles += [
        Line2D([], [], color=shown.colour, marker="o", ms=4, lw=1, alpha=0.8, label=f"paper 1: {name}")
        for name, shown in blends.items()
    ]
    handles.append(Line2D([], [], color=style.INK, lw=0.9, label="Pareto front of this run"))
    nothing: dict[str, Any] = {"ls": "", "marker": ""}
    handles.append(Line2D([], [], ls="", marker="o", mfc="none", mec=style.INK, ms=9, label="on it in other runs too:"))
    for number, row in enumerate(front_rows(settings).itertuples(), start=1):
        found = f"{percent(row.rmse_of_peak)} in {seconds(row.online_median_s)}"
        handles.append(Line2D([], [], **nothing, label=f"{number}  {label(row.model, row.setting)}\n    {found}"))
    return handles
