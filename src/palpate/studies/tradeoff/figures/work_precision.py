"""Draw error against online time of every model at its settings, on one scene: the work–precision diagram."""

from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.comparison import KINDS
from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.report.number_format import percent, seconds
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.figures.precision_panel import WIDTH, line_style, panel, rim
from palpate.studies.tradeoff.figures.scene_rows import answers, averaged, curves, first_split, front_rows

TABLES = ("accuracy_vs_time", "advice")
_WHERE = {"rms": "over the surface, RMSE", "patch": "at the patch, RMS"}
"""The kinds of error, of a panel each."""


@style.styled
def draw(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw the error over the surface and the error at the patch of all models on one ``scene``, side by side.

    accuracy_vs_time, advice : the tables of these names
    The stepped line is the front of this run; the numbered points are on it in other runs too. A setting that failed
    on some samples is hollow, and is named below with those that failed on all samples.
    """
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, first_split(advice)))
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
    axis.text(
        0,
        0,
        fill(text, 190),
        transform=axis.transAxes,
        va="bottom",
        fontsize=7.5,
        color="#aa0000" if failures else "#666666",
    )


def _handle(model: str, rows: pd.DataFrame) -> Line2D:
    shown, (edge, width) = look(model), rim(rows["prepared"].all())
    size = 9 if shown.marker == "*" else 6.5
    return Line2D(
        [], [], color=shown.colour, ls=line_style(rows), lw=1.3, marker=shown.marker, ms=size, mec=edge, mew=width,
        label=shown.label + (", L: level" if model.startswith("fem_p") else ""),
    )  # fmt: skip
