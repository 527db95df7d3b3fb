"""Draw the score of an engine: error against time, hollow as times are another machine's, beside palpate's models."""

from collections.abc import Mapping
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from palpate.benchmark.engine_scores import OWN
from palpate.benchmark.ranking import EXACT, front
from palpate.report import style
from palpate.report.model_looks import look

HOLLOW = (("#8b0000", "o"), ("#4b0082", "s"), ("#bc8f00", "^"), ("#5f9ea0", "D"), ("#708090", "v"))
"""Colour and marker of each engine, in turn: no model of palpate's has them."""


@style.styled
def draw_score(table: pd.DataFrame, floor: Mapping[str, float]) -> Figure:
    """Draw rows of score.csv; floor : mean own errors of the truth."""
    engine, others = (table[(table["engine"] == OWN) == own] for own in (False, True))
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    felt = table["force_rms_of_peak"].notna().any()
    second = ("force_rms_of_peak", "of the force over time") if felt else ("patch_rms_of_peak", "in the dent")
    kinds = [("rmse_of_peak", "over the surface")] + [second] * bool(table[second[0]].notna().any())
    axes = figure.subplots(1, len(kinds), sharey=True, squeeze=False)[0]
    moves = table["real_time_factor"].notna().any()
    for axis, (column, where) in zip(axes, kinds, strict=True):
        xlabel = "seconds for a second of motion" if moves else "time of an answer [ms]"
        axis.set(xscale="log", yscale="log", xlabel=xlabel, title=where)
        for model, rows in others.groupby("model", sort=False):
            t, error = _placed(rows, column)
            best = front(t, error)
            shown = look(str(model))
            axis.plot(
                t[best], error[best], color=shown.colour, marker=shown.marker, ms=4, lw=0.8, alpha=0.6, mew=0,
                label=shown.label,
            )  # fmt: skip
        curves = engine.groupby(["engine", "hardware"], sort=False)
        for ((name, _), rows), (colour, marker) in zip(curves, cycle(HOLLOW)):
            t, error = _placed(rows, column)
            lost = int(rows["failures"].sum())
            where = "its own machine" + (f", {lost} of {int(rows['samples'].sum())} failed" if lost else "")
            axis.plot(
                t, error, color=colour, marker=marker, mfc="white", mew=1.4, ms=7, lw=1.2, ls=(0, (3, 2)),
                label=f"{name} ({where})",
            )  # fmt: skip
        if np.isfinite(floor.get(column, np.nan)):
            axis.axhline(100 * max(floor[column], EXACT), color=style.FAINT, lw=1, ls=":")
        style.plain_log(axis.xaxis)
    axes[0].set_ylabel("error [% of the peak]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=7)
    figure.suptitle(f"{engine['scene'].iloc[0]}: dotted is the truth's own error", fontsize=9)
    return figure


def _placed(rows: pd.DataFrame, column: str) -> tuple[np.ndarray, np.ndarray]:
    error = rows[column].to_numpy(dtype=float)
    time = (1e3 * rows["online_median_s"]).where(rows["real_time_factor"].isna(), rows["real_time_factor"])
    return time.to_numpy(dtype=float), 100 * np.maximum(error, EXACT)
