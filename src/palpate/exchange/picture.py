"""Draw the score of an engine: error against time, hollow as times are another machine's, beside palpate's models."""

from collections.abc import Mapping
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from palpate.benchmark.engine_scores import OWN
from palpate.report import style
from palpate.report.work_precision import curves, handles, own_error, points

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
    time, factor, xlabel = "online_median_s", 1e3, "time of an answer [ms]"
    if table["real_time_factor"].notna().any():
        time, factor, xlabel = "real_time_factor", 1.0, "seconds for a second of motion"
    for axis, (column, where) in zip(axes, kinds, strict=True):
        axis.set(xlabel=xlabel, title=where)
        curves(axis, points(others, time, column, factor))
        own = engine.groupby(["engine", "hardware"], sort=False)
        for ((name, _), rows), (colour, marker) in zip(own, cycle(HOLLOW)):
            drawn = points(rows, time, column, factor)
            lost = int(rows["failures"].sum())
            where = "its own machine" + (f", {lost} of {int(rows['samples'].sum())} failed" if lost else "")
            axis.plot(
                drawn["time"], drawn["error"], color=colour, marker=marker, mfc="white", mew=1.4, ms=7, lw=1.2,
                ls=(0, (3, 2)), label=f"{name} ({where})",
            )  # fmt: skip
        style.plain_log(axis.xaxis)
    for axis, (column, _) in zip(axes, kinds, strict=True):
        own_error(axis, floor.get(column, np.nan))
    axes[0].set_ylabel("error [% of the peak]")
    shown = handles(points(others, time, "rmse_of_peak", factor)) + axes[0].get_legend_handles_labels()[0]
    figure.legend(handles=shown, loc="outside lower center", ncols=3, fontsize=7)
    figure.suptitle(engine["scene"].iloc[0], fontsize=9)
    return figure
