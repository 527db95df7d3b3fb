"""Errors of what was left out as bars: a group for each way of leaving out, a bar a model."""

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes

from palpate.report import style

HEIGHT = 0.17
"""Of a bar's row [inch]."""


def draw_errors(
    axis: Axes, rows: pd.DataFrame, ways: Mapping[str, str], names: Mapping[str, str], floors: Sequence[str], error: str
) -> None:
    """Draw medians as bars, and lines to the ninetieth percentiles.

    rows : columns ``way``, ``model`` and ``error`` (a share); ways, names : words for the first two, in their order;
    floors : models that are no models but the spread of the data
    """
    places, labels, at = [], [], 0.0
    known = rows[rows["way"].isin(ways) & rows["model"].isin(names)].groupby(["way", "model"])[error]
    shown = 100.0 * known.quantile(0.9)
    most = min(float(shown.max()), 3.0 * float((100.0 * known.median()).median()))
    for way, title in ways.items():
        part = rows[rows["way"].eq(way)]
        if part.empty:
            continue
        axis.text(0.0, at, f"left out: {title}", va="center", fontsize="small", weight="bold")
        at += 1.0
        for model, label in names.items():
            errors = 100.0 * part.loc[part["model"].eq(model), error].dropna()
            if errors.empty:
                continue
            colour = "#b5b5b5" if model in floors else "#0072b2"
            axis.barh(at, errors.median(), height=0.7, color=colour)
            if errors.median() > 1.15 * most:
                axis.text(
                    1.14 * most, at, f"{errors.median():.0f} % ", va="center", ha="right", fontsize=7, color="white"
                )
            axis.plot([errors.median(), errors.quantile(0.9)], [at, at], color=style.INK, lw=1)
            places.append(at)
            labels.append(label)
            at += 1.0
        at += 0.4
    axis.set_yticks(places, labels)
    axis.set_ylim(at - 0.2, -0.8)
    axis.set_xlim(0.0, 1.15 * most)
    axis.grid(axis="y", visible=False)


def rows_of(rows: pd.DataFrame, ways: Sequence[str], names: Sequence[str]) -> int:
    """Return how many lines ``draw_errors`` needs."""
    known = rows[rows["way"].isin(ways) & rows["model"].isin(names)]
    return len(known.drop_duplicates(["way", "model"])) + 2 * known["way"].nunique()
