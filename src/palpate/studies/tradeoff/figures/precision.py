"""Draw error against online time of every model at its settings, and of those that are worth taking, on one scene."""

from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.choosing import NONE
from palpate.benchmark.model import LIMIT
from palpate.benchmark.ranking import KINDS, UNKNOWN, ZERO, averaged, fields_of, front, own_error
from palpate.models.model_registry import FAMILY_OF
from palpate.report import style, tables
from palpate.report import work_precision as diagram
from palpate.report.model_looks import label, look
from palpate.report.words import percent, seconds
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, answers, front_rows

WIDTH = 88
"""Letters in a line of small text that is as wide as a panel."""
_CORNERS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
"""Where the number of a point stands, in turn for points that are near each other."""


def settings_of(settings: pd.DataFrame, column: str = "rmse_of_peak") -> pd.DataFrame:
    """Return the points of all models of one scene; settings : rows as ``ranking.averaged`` gives them."""
    rows = answers(settings)
    target = fields_of(rows, "target")["target"] == LIMIT
    looks = {"curve": rows["model"].map(lambda model: FAMILY_OF.get(model, model))}
    looks |= {"line": rows["sees"].mask(target, LIMIT), "part": np.where(target, LIMIT, "")}
    looks |= {"hollow": rows["failures"] > 0, "prepared": rows["prepared"].astype(bool)}
    if rows["splits"].max() > 1:
        looks |= {end: rows[f"{column}_{end}"] for end in ("low", "high")}
    return diagram.points(rows, "online_median_s", column, **looks)


def panel(axis, settings: pd.DataFrame, column: str) -> None:
    """Draw the error ``column`` of every model of one scene, its front, the zero answer and the truth's own error."""
    drawn = settings_of(settings, column)
    axis.set_xlabel("online time of an answer [ms]")
    diagram.curves(axis, drawn)
    for model in LEVELLED:
        _levels(axis, settings.loc[drawn.index[(drawn["model"] == model) & (drawn["part"] == "")]], drawn)
    diagram.steps(axis, drawn[~drawn["hollow"]])
    _numbers(axis, drawn.loc[front_rows(settings, column).index])
    diagram.nothing(axis, settings.loc[settings["model"] == ZERO, column].mean())
    diagram.own_error(axis, own_error(settings, column), known=KNOWN, unknown=UNKNOWN)


LEVELLED = ("fem_p1", "fem_p2")
"""Models whose levels are joined each, and named at their end."""


def _levels(axis, rows: pd.DataFrame, drawn: pd.DataFrame) -> None:
    """Join the front of each level of a finite-element model, and write the level at its end."""
    for level, points in rows.groupby(fields_of(rows, "level")["level"].astype(float)):
        points = drawn.loc[points.index]
        best = points.iloc[front(points["time"], np.round(np.log(points["error"]), 2))]
        colour = look(best["model"].iloc[0]).colour
        axis.plot(best["time"], best["error"], color=colour, lw=0.6, alpha=0.6, zorder=1)
        end_point = (best["time"].iloc[-1], best["error"].iloc[-1])
        axis.annotate(f"L{level:g}", end_point, (2, 4), textcoords="offset points", fontsize=7, color=colour, zorder=4)


def _numbers(axis, best: pd.DataFrame) -> None:
    """Draw a number at each point that is on the front in other runs too."""
    numbered: list[np.ndarray] = []
    for number, point in enumerate(best[["time", "error"]].to_numpy(), start=1):
        axis.plot(*point, "o", mfc="none", mec=style.INK, mew=0.9, ms=14, zorder=4)
        n_near = sum(bool((np.abs(np.log(point) - earlier) < np.log((1.5, 1.25))).all()) for earlier in numbered)
        numbered.append(np.log(point))
        x, y = _CORNERS[n_near % len(_CORNERS)]
        aligned: dict = {"ha": "right" if x < 0 else "left", "va": "top" if y < 0 else "bottom"}
        looks: dict = {"textcoords": "offset points", "fontsize": 8, "fontweight": "bold", "color": style.INK}
        axis.annotate(str(number), point, (9 * x, 9 * y), zorder=5, **aligned, **looks)


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
        diagram.limits(axis, _budgets(tables.where(advice.dropna(subset="budget_ms"), error=kind)))
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


def _budgets(advice: pd.DataFrame) -> dict[float, str]:
    """Return the limits of time [ms] with the advised model for each."""
    names = [NONE if model == NONE else label(model, "default").split(",")[0] for model in advice["model"]]
    labels = zip(advice["budget_ms"], names, strict=True)
    return {budget: f"{budget:g} ms:\n{fill(name, 9, break_long_words=False)}" for budget, name in labels}


def _front_lines(settings: pd.DataFrame, column: str) -> str:
    """Name the models that are on the front of a panel in other runs too, in lines as wide as the panel."""
    lines = [
        f"{number}  {label(row['model'], row['setting'])}: {percent(row[column])} in {seconds(row['online_median_s'])}"
        for number, (_, row) in enumerate(front_rows(settings, column).iterrows(), start=1)
    ]
    return "\n".join(fill(line, WIDTH, subsequent_indent="    ", drop_whitespace=False) for line in lines)


def _legend(axis, settings: pd.DataFrame) -> None:
    """List every curve in table order, then what lines and rims mean; below, the settings that failed."""
    shown = diagram.handles(settings_of(settings))
    for handle in shown:
        if handle.get_label() in [look(model).label for model in LEVELLED]:
            handle.set_label(f"{handle.get_label()}, L: level")
    ink: dict = {"color": style.INK, "lw": 1.3}
    words = {"load": "knows the load", "deformation": "sees a coarse deformation only"}
    words |= {LIMIT: "white dot: extrapolated to ever finer meshes"}
    shown += [Line2D([], [], **ink, ls=diagram.LINES[line], label=meaning) for line, meaning in words.items()]
    shown += diagram.meanings("contact prepared before", "failed on some samples")
    shown.append(Line2D([], [], color=style.INK, lw=0.9, drawstyle="steps-post", label="Pareto front of this run"))
    shown.append(Line2D([], [], ls="", marker="o", mfc="none", mec=style.INK, ms=10, label="on it in other runs too"))
    failed = settings[(settings["failures"] > 0) | ~np.isfinite(settings["rmse_of_peak"])]
    failures = [f"{label(row.model, row.setting)} on {row.failures} of {row.samples}" for row in failed.itertuples()]
    text = "failed: " + ", ".join(failures) if failures else "no setting failed on any sample"
    diagram.legend(axis, shown, text, failed=bool(failures))


_WIDTH, _PLOT, _LINE = 3.6, 2.75, 0.17  # [inch] of the figure; height of the diagram, and of a line of text below it


@style.figure("best_models", tables=("accuracy_vs_time", "advice"))
def draw_best_models(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw the lasting front of one ``scene`` in colour, with its models named below, and everything else in grey."""
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, advice))
    settings = averaged(settings)
    best, own = front_rows(settings), own_error(settings)
    best = best.join(fields_of(best, "target"))
    drawn = settings_of(settings[settings["failures"] == 0])
    below = 0.48 + _LINE * (len(best) + 2)
    figure = Figure(figsize=(_WIDTH, _PLOT + below))
    height = figure.get_figheight()
    axis = figure.add_axes((0.165, below / height, 0.77, (_PLOT - 0.08) / height))
    axis.set(xscale="log", yscale="log")
    axis.set_xlabel("time of an answer [ms]", fontsize=8, labelpad=1)
    axis.set_ylabel("error [% of the peak displacement]", fontsize=8, labelpad=1)
    axis.plot(drawn["time"], drawn["error"], "o", color="#c9ced3", ms=3, mew=0, zorder=1)
    axis.margins(0.06)
    diagram.steps(axis, drawn, style.FAINT, 2)
    lines = [_LINE * number for number in range(len(best) + 1)]  # [inch] below the first
    for number, (line, row, point) in enumerate(
        zip(lines, best.itertuples(), drawn.loc[best.index, ["time", "error"]].to_numpy(), strict=False), start=1
    ):
        bold: dict = {"fontweight": "bold", "color": look(row.model).colour}
        axis.plot(*point, "o", color=bold["color"], mec="white", mew=0.8, ms=11, zorder=4)
        inside = bold | {"color": "white", "ha": "center", "va": "center", "fontsize": 8, "zorder": 5}
        axis.annotate(str(number), point, **inside)
        name = label(row.model, "default") + (", limit" if row.target == LIMIT else "")
        text = f"{number}  {name}: {percent(row.rmse_of_peak)} in {seconds(row.online_median_s)}"
        figure.text(0.02, (below - 0.48 - line) / height, text, fontsize=7.4, va="top", **bold)
    remark = "grey: other settings; red: no displacement at all"
    remark += f"\n{UNKNOWN}" if np.isnan(own) else f"\nband: below the error of the truth itself, {percent(own)}"
    figure.text(0.02, (below - 0.48 - lines[-1]) / height, remark, fontsize=7.5, va="top", color="#666666")
    diagram.nothing(axis, settings.loc[settings["model"] == ZERO, "rmse_of_peak"].mean())
    diagram.own_error(axis, own)
    diagram.finish([axis], diagram.frames(advice["budget_ms"].dropna().unique()), inside=True)
    return figure
