"""Draw error against online time of every model at its settings, and of those that are worth taking, on one scene."""

from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.choosing import NONE
from palpate.benchmark.model import LIMIT
from palpate.benchmark.ranking import EXACT, KINDS, UNKNOWN, ZERO, averaged, fields_of, front, own_error
from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.report.words import percent, seconds
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, answers, by_target, curves, front_rows

LEAST_PERCENT = 100 * EXACT
"""Errors [% of the peak] below this are drawn at it."""
STRIP = 0.09
"""Share of a panel's height that is left free below all points, for two lines of words."""
WIDTH = 88
"""Letters in a line of small text that is as wide as a panel."""
_CORNERS = ((-1, -1), (1, 1), (1, -1), (-1, 1))
"""Where the number of a point stands, in turn for points that are near each other."""


def panel(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the error ``column`` of every model of one scene, its front, the truth's own error and the zero answer.

    settings : rows as ``comparison.averaged`` gives them
    """
    axis.set(xscale="log", yscale="log", xlabel="online time of an answer [ms]")
    for model, rows in curves(answers(settings).dropna(subset=[column])).items():  # one may have failed everywhere
        _curve(axis, model, rows, column)
    _front(axis, settings, column)
    _zero(axis, settings, column)
    _truth(axis, own_error(settings, column))


def milliseconds_and_percent(rows: pd.DataFrame, column: str = "rmse_of_peak") -> tuple[np.ndarray, np.ndarray]:
    """Return where settings are drawn: their median time [ms] and their error [% of the peak]."""
    return 1e3 * rows["online_median_s"].to_numpy(), np.maximum(100 * rows[column].to_numpy(), LEAST_PERCENT)


def line_style(rows: pd.DataFrame) -> str | tuple[int, tuple[int, int]]:
    """Return the line of a model that knows the load, or of one that sees a coarse deformation only."""
    return "-" if (rows["sees"] == "load").all() else (0, (4, 2))


def rim(prepared: bool) -> tuple[str, float]:
    """Return the colour and width of the rim of a marker: black where contacts were prepared."""
    return ("black", 0.9) if prepared else ("white", 0.5)


def _curve(axis, model: str, rows: pd.DataFrame, column: str) -> None:
    """Draw a line through the settings that are meant for the finest mesh, and one through those for the limit."""
    for target, part in by_target(rows):
        _line_of(axis, model, part, column, target == LIMIT)
        if model.startswith("fem_p") and target != LIMIT:
            _levels(axis, part, column)


TO_LIMIT = (0, (6, 1.5, 1, 1.5))
"""The line of settings meant for the limit of ever finer meshes, whose markers have a white dot as well."""


def _line_of(axis, model: str, rows: pd.DataFrame, column: str, to_limit: bool) -> None:
    """Draw settings, or of variants the front, a line through it, and a band over the splits around that."""
    t, error = milliseconds_and_percent(rows, column)
    shown, best = look(model), front(t, error)
    axis.plot(t[best], error[best], color=shown.colour, ls=TO_LIMIT if to_limit else line_style(rows), lw=1.4, zorder=2)
    if rows["splits"].max() > 1:
        low, high = (
            np.maximum(100 * rows[f"{column}_{end}"].to_numpy()[best], LEAST_PERCENT) for end in ("low", "high")
        )
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
        if to_limit:
            axis.plot(t[i], error[i], **DOT, zorder=4)


DOT: dict = {"ls": "", "marker": ".", "color": "white", "ms": 3.5, "mew": 0}
"""In the markers of settings that are meant for the limit."""


def _levels(axis, rows: pd.DataFrame, column: str) -> None:
    """Join the front of each level of a finite-element model, and write the level at its end."""
    t, error = milliseconds_and_percent(rows, column)
    colour = look(rows["model"].iloc[0]).colour
    levels = fields_of(rows, "level")["level"].to_numpy(dtype=float)
    for level in sorted(set(levels[~pd.isna(levels)])):
        own = np.flatnonzero(levels == level)
        own = own[front(t[own], np.round(np.log(error[own]), 2))]
        axis.plot(t[own], error[own], color=colour, lw=0.6, alpha=0.6, zorder=1)
        place = (t[own[-1]], error[own[-1]])
        axis.annotate(f"L{level:g}", place, (2, 4), textcoords="offset points", fontsize=7, color=colour, zorder=4)


def _front(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the steps of this run's front, and a number at each point that is on it in other runs too."""
    whole = answers(settings)
    _steps(axis, whole[whole["failures"] == 0], column, style.INK, 1)
    before: list[np.ndarray] = []
    for number, (_, row) in enumerate(front_rows(settings, column).iterrows(), start=1):
        place = (1e3 * row["online_median_s"], max(100 * row[column], LEAST_PERCENT))
        axis.plot(*place, "o", mfc="none", mec=style.INK, mew=0.9, ms=14, zorder=4)
        near = sum(bool((np.abs(np.log(place) - other) < np.log((1.5, 1.25))).all()) for other in before)
        before.append(np.log(place))
        x, y = _CORNERS[near % len(_CORNERS)]
        axis.annotate(
            str(number), place, (9 * x, 9 * y), textcoords="offset points", ha="right" if x < 0 else "left",
            va="top" if y < 0 else "bottom", fontsize=8, fontweight="bold", color=style.INK, zorder=5,
        )  # fmt: skip


def _steps(axis, rows: pd.DataFrame, column: str, colour: str, zorder: int) -> None:
    """Draw the front of ``rows`` as steps up to the edge of the panel."""
    t, error = milliseconds_and_percent(rows, column)
    best = front(t, rows[column])
    ends = [*t[best], axis.get_xlim()[1]]
    axis.plot(ends, [*error[best], error[best][-1]], color=colour, lw=0.9, drawstyle="steps-post", zorder=zorder)


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


def _truth(axis, own: float) -> None:
    """Draw the truth's ``own`` error as a band."""
    least, most = axis.get_ylim()
    low = least * (least / most) ** STRIP  # no point or line where the words are
    if not np.isfinite(own):
        axis.set_ylim(low, None)
        text, colour = UNKNOWN, look(ZERO).colour
    else:
        low = min(low, 50 * own)
        axis.set_ylim(low, None)
        axis.axhspan(low, 100 * own, color="#ececec", zorder=0)
        text, colour = f"grey: below the error of the truth itself, {percent(own)}; models are tied", "#555555"
        if own > KNOWN:
            text = f"The truth is known to {percent(own)} only, not to {percent(KNOWN)} (grey: models are tied)"
            colour = look(ZERO).colour
    axis.annotate(
        fill(text, WIDTH), (0, 0), (4, 4), xycoords="axes fraction", textcoords="offset points", fontsize=7.5,
        color=colour, zorder=5,
    ).set_in_layout(False)  # fmt: skip


_WHERE = {"rms": "over the surface, RMSE", "patch": "at the patch, RMS"}
"""The kinds of error, of a panel each."""


@style.figure("work_precision", tables=("accuracy_vs_time", "advice"))
def draw_work_precision(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw the error over the surface and the error at the patch of all models on one ``scene``, side by side.

    The stepped line is the front of this run; the numbered points are on it in other runs too. A setting that failed
    on some samples is hollow, and is named below with those that failed on all samples.
    """
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, advice))
    splits = settings["split"].nunique()
    settings = averaged(settings)
    listed = {kind: _front_lines(settings, column) for kind, column in KINDS.items()}
    heights = [5.6, 0.1 + 0.15 * max(text.count("\n") + 1 for text in listed.values()), 1.35]
    figure = Figure(figsize=(12.5, 0.6 + sum(heights)), layout="constrained")
    places: Any = [["rms", "patch"], ["rms front", "patch front"], ["legend", "legend"]]
    parts = figure.subplot_mosaic(places, height_ratios=heights)
    parts["patch"].sharex(parts["rms"])
    for kind, column in KINDS.items():
        axis = parts[kind]
        panel(axis, settings, column)
        _budgets(axis, tables.where(advice.dropna(subset="budget_ms"), error=kind))
        axis.set_ylabel(f"error {_WHERE[kind]} [% of peak]")
        style.plain_log(axis.yaxis)
        parts[f"{kind} front"].set_axis_off()
        below = parts[f"{kind} front"].text(0, 1, listed[kind], va="top", fontsize=7.5, linespacing=1.25)
        below.set_in_layout(False)  # a wide text would make the panels narrow
    style.plain_log(parts["rms"].xaxis)
    title = f"{settings['body'].iloc[0]}, {settings['regime'].iloc[0]} loads".replace("_", " ")
    parts["rms"].set_title(
        title + (f": means of {splits} splits, bands from the least to the largest" if splits > 1 else ""), pad=50
    )
    _legend(parts["legend"], settings)
    return figure


def _budgets(axis, advice: pd.DataFrame) -> None:
    """Draw frame budgets with the advised model for each."""
    for row in advice.itertuples():
        axis.axvline(row.budget_ms, color="#b5b5b5", ls=":", lw=1, zorder=1)
        advised = NONE if row.model == NONE else label(row.model, "default").split(",")[0]
        axis.annotate(
            f"{row.budget_ms:g} ms:\n{fill(advised, 12)}", (row.budget_ms, 1), (0, 3),
            xycoords=("data", "axes fraction"), textcoords="offset points", ha="center", va="bottom", fontsize=7.5,
            color="#444444",
        )  # fmt: skip


def _front_lines(settings: pd.DataFrame, column: str) -> str:
    """Name the models that are on the front of a panel in other runs too, in lines as wide as the panel."""
    lines = [
        f"{number}  {label(row['model'], row['setting'])}: {percent(row[column])} in {seconds(row['online_median_s'])}"
        for number, (_, row) in enumerate(front_rows(settings, column).iterrows(), start=1)
    ]
    return "\n".join(fill(line, WIDTH, subsequent_indent="    ", drop_whitespace=False) for line in lines)


def _legend(axis, settings: pd.DataFrame) -> None:
    """List every curve in table order, then what lines and rims mean; below, the settings that failed."""
    axis.set_axis_off()
    handles = [_handle(model, rows) for model, rows in curves(answers(settings)).items()]
    ink: dict = {"color": style.INK, "lw": 1.3, "marker": ""}
    marked: dict = {"ls": "", "marker": "o", "mfc": "#bbbbbb", "ms": 7}
    handles += [
        Line2D([], [], **ink, ls="-", label="knows the load"),
        Line2D([], [], **ink, ls=(0, (4, 2)), label="sees a coarse deformation only"),
        Line2D([], [], color=style.INK, lw=1.3, ls=TO_LIMIT, label="white dot: extrapolated to ever finer meshes"),
        Line2D([], [], **marked, mec="black", mew=0.9, label="contact prepared before"),
        Line2D([], [], ls="", marker="o", mfc="white", mec="#888888", ms=7, label="failed on some samples"),
        Line2D([], [], color=style.INK, lw=0.9, drawstyle="steps-post", label="Pareto front of this run"),
        Line2D([], [], ls="", marker="o", mfc="none", mec=style.INK, ms=10, label="on it in other runs too"),
    ]
    axis.legend(
        handles=handles, loc="upper left", ncols=5, fontsize=7.5, borderaxespad=0, handlelength=2.6, columnspacing=1.4
    )
    failed = settings[(settings["failures"] > 0) | ~np.isfinite(settings["rmse_of_peak"])]
    failures = [f"{label(r.model, r.setting)} on {r.failures} of {r.samples}" for r in failed.itertuples()]
    text = "failed: " + ", ".join(failures) if failures else "no setting failed on any sample"
    colour = "#aa0000" if failures else "#666666"
    axis.text(0, 0, fill(text, 190), transform=axis.transAxes, va="bottom", fontsize=7.5, color=colour)


def _handle(model: str, rows: pd.DataFrame) -> Line2D:
    shown, (edge, width) = look(model), rim(rows["prepared"].all())
    size = 9 if shown.marker == "*" else 6.5
    return Line2D(
        [], [], color=shown.colour, ls=line_style(rows), lw=1.3, marker=shown.marker, ms=size, mec=edge, mew=width,
        label=shown.label + (", L: level" if model.startswith("fem_p") else ""),
    )  # fmt: skip


_WIDTH, _PLOT, _LINE = 3.6, 2.75, 0.17  # [inch] of the figure; height of the diagram, and of a line of text below it


@style.figure("best_models", tables=("accuracy_vs_time", "advice"))
def draw_best_models(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw the lasting front of one ``scene`` in colour, with its models named below, and everything else in grey."""
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, advice))
    settings = averaged(settings)
    best, own = front_rows(settings), own_error(settings)
    best = best.join(fields_of(best, "target"))
    nothing = settings.loc[settings["model"] == ZERO, "rmse_of_peak"].mean()
    settings = answers(settings[settings["failures"] == 0])
    below = 0.48 + _LINE * (len(best) + 2)
    figure = Figure(figsize=(_WIDTH, _PLOT + below))
    height = figure.get_figheight()
    axis = figure.add_axes((0.165, below / height, 0.77, (_PLOT - 0.08) / height))
    axis.set(xscale="log", yscale="log")
    axis.set_xlabel("time of an answer [ms]", fontsize=8, labelpad=1)
    axis.set_ylabel("error [% of the peak displacement]", fontsize=8, labelpad=1)
    t, error = milliseconds_and_percent(settings)
    axis.plot(t, error, "o", color="#c9ced3", ms=3, mew=0, zorder=1)
    _steps(axis, settings, "rmse_of_peak", style.FAINT, 2)
    for number, row in enumerate(best.itertuples(), start=1):
        _point(axis, number, row)
        figure.text(
            0.02, (below - 0.48 - _LINE * (number - 1)) / height, _line(number, row), fontsize=7.4, va="top",
            color=look(row.model).colour, fontweight="bold",
        )  # fmt: skip
    figure.text(
        0.02, (below - 0.48 - _LINE * len(best)) / height, _remark(own), fontsize=7.5, va="top", color="#666666"
    )
    for budget in advice["budget_ms"].dropna().unique():
        axis.axvline(budget, color="#b5b5b5", ls=":", lw=1, zorder=0)
        axis.annotate(
            f"{budget:g} ms", (budget, 0), (-1.5, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="right", va="bottom", rotation=90, fontsize=7.5, color="#555555",
        )  # fmt: skip
    axis.margins(0.06)
    if nothing > 0:
        axis.axhline(100 * nothing, color=look(ZERO).colour, lw=1, ls=(0, (1, 1.5)), zorder=1)
    if own > 0:
        low = min(axis.get_ylim()[0], 60 * own)
        axis.set_ylim(low, None)
        axis.axhspan(low, 100 * own, color="#ececec", zorder=0)
    style.plain_log(axis.xaxis)
    style.plain_log(axis.yaxis)
    return figure


def _remark(own: float) -> str:
    """Explain what is drawn in grey and in red."""
    band = f"\nband: below the error of the truth itself, {percent(own)}" if own > 0 else ""
    band = f"\n{UNKNOWN}" if np.isnan(own) else band
    return f"grey: other settings; red: no displacement at all{band}"


def _point(axis, number: int, row) -> None:
    """Draw a model of the front with its number."""
    place, shown = (1e3 * row.online_median_s, max(100 * row.rmse_of_peak, LEAST_PERCENT)), look(row.model)
    axis.plot(*place, "o", color=shown.colour, mec="white", mew=0.8, ms=11, zorder=4)
    axis.annotate(str(number), place, ha="center", va="center", fontsize=8, fontweight="bold", color="white", zorder=5)


def _line(number: int, row) -> str:
    """Name a model of the front, what it is meant for, its error and its time."""
    target = ", limit" if row.target == LIMIT else ""
    name = f"{label(row.model, 'default')}{target}"
    return f"{number}  {name}: {percent(row.rmse_of_peak)} in {seconds(row.online_median_s)}"
