"""Errors of what was left out as bars: a group for each way of leaving out, a bar a model."""

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from palpate.report import style

HEIGHT = 0.17
"""Of a bar's row [inch]."""


def figure_of_errors(
    rows: pd.DataFrame, by: str, error: str, ways: Mapping[str, str], names: Mapping[str, str], floors: Sequence[str],
    over: str, widths: tuple[float, float] = (1.0, 1.0),
) -> tuple[Figure, GridSpec]:  # fmt: skip
    """Draw medians as bars, and lines to the ninetieth percentiles, on the right; return the figure and its 2 × 2 grid.

    by, error : columns of ``rows``: what is left out, and a share of what ``over`` names
    ways, names : words for what is left out and for models, in their order
    floors : names of models that only show the spread of the data; widths : of the grid's columns
    """
    groups = rows[rows[by].isin(ways) & rows["model"].isin(names)].groupby([by, "model"])[error]
    lines = groups.ngroups + 2 * sum(way in set(rows[by]) for way in ways)
    figure = Figure(figsize=(10.0, max(6.4, HEIGHT * lines)), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=widths)
    axis, ticks, labels, y = figure.add_subplot(grid[:, 1]), [], [], 0.0
    p90 = 100.0 * groups.quantile(0.9)
    longest = min(float(p90.max()), 3.0 * float((100.0 * groups.median()).median()))
    for way, title in ways.items():
        of_way = rows[rows[by].eq(way)]
        if of_way.empty:
            continue
        axis.text(0.0, y, f"left out: {title}", va="center", fontsize="small", weight="bold")
        y += 1.0
        for model, label in names.items():
            errors = 100.0 * of_way.loc[of_way["model"].eq(model), error].dropna()
            if errors.empty:
                continue
            colour = "#b5b5b5" if model in floors else "#0072b2"
            axis.barh(y, errors.median(), height=0.7, color=colour)
            if errors.median() > 1.15 * longest:
                axis.text(
                    1.14 * longest, y, f"{errors.median():.0f} % ", va="center", ha="right", fontsize=7, color="white"
                )
            axis.plot([errors.median(), errors.quantile(0.9)], [y, y], color=style.INK, lw=1)
            ticks.append(y)
            labels.append(label)
            y += 1.0
        y += 0.4
    axis.set_yticks(ticks, labels)
    axis.set_ylim(y - 0.2, -0.8)
    axis.set_xlim(0.0, 1.15 * longest)
    axis.grid(axis="y", visible=False)
    axis.set(xlabel=f"error {over} [%]: median; line to 90th percentile")
    return figure, grid
