"""Error over online time of every method: a work–precision diagram."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.pareto import front

TABLES = ("enrichment_accuracy", "online_cost", "fem_cost")
BUDGETS_S = {"1 ms": 1e-3, "16.7 ms": 1 / 60, "100 ms": 0.1}
"""Frame budgets: haptics, 60 pictures a second, and a response that still seems immediate."""


@style.styled
def draw(enrichment_accuracy, online_cost, fem_cost, *, split: str = "contacts") -> Figure:
    """Draw one column for each body and one row for each protocol and regime, for one ``split``.

    enrichment_accuracy, online_cost, fem_cost : the tables of these names
    The whisker ends at the 95th percentile of the time. The stepped line is the Pareto front. A method without a
    finite error or time is named in its panel as failed.
    """
    accuracy = tables.where(enrichment_accuracy, split=split)
    joined = accuracy.merge(online_cost, on=["body", "protocol", "method"], how="left")
    names = tables.bodies(joined)
    rows = list(dict.fromkeys(zip(joined["protocol"], joined["regime"], strict=True)))
    figure = Figure(figsize=(4.0 * len(names) + 2.4, 2.35 * len(rows) + 0.6), layout="constrained")
    grid = figure.subplots(len(rows), len(names), sharex=True, sharey=True, squeeze=False)
    for axes, (protocol, regime) in zip(grid, rows, strict=True):
        for axis, body in zip(axes, names, strict=True):
            panel = tables.where(joined, body=body, protocol=protocol, regime=regime)
            _points(axis, panel)
            _lines(axis, tables.where(fem_cost, body=body, regime=regime)["seconds"])
            axis.set_title(f"{body}, {protocol} protocol, {regime} loads")
        axes[0].set_ylabel("RMSE [% of peak]")
    for axis in grid[-1]:
        axis.set_xlabel("online time a query [ms]")
        style.plain_log(axis.xaxis)
    low, high = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(low / 6, high)  # room for the names of lines and failures
    style.plain_log(grid[0, 0].yaxis)
    figure.legend(handles=_legend(joined["method"]), loc="outside right center", title="less of both is better")
    return figure


def _points(axis, panel) -> None:
    """Draw the methods of one panel and their front, and name those that failed."""
    milliseconds = 1e3 * panel["online_median_s"].to_numpy()
    late = 1e3 * panel["online_p95_s"].to_numpy()
    error = 100 * panel["rmse_of_peak"].to_numpy()
    for method, t, p95, e in zip(panel["method"], milliseconds, late, error, strict=True):
        look = style.look(method)
        size = 13 if look.marker == "*" else 6.5
        axis.plot([t, p95], [e, e], color=look.colour, lw=1, zorder=3)
        axis.plot(t, e, look.marker, color=look.colour, mec="white", mew=0.6, ms=size, zorder=4)
    best = front(milliseconds, error)
    axis.plot(milliseconds[best], error[best], color=style.INK, lw=1, drawstyle="steps-post", zorder=2)
    failed = panel["method"][~(np.isfinite(milliseconds) & np.isfinite(error))]
    if len(failed):
        text = "failed: " + ", ".join(style.look(m).label for m in failed)
        axis.text(0.01, 0.03, text, transform=axis.transAxes, fontsize=7, color="#aa0000")
    axis.set(xscale="log", yscale="log")


def _lines(axis, fem_seconds) -> None:
    """Draw frame budgets, and the median time of the fine simulation that the methods replace."""
    budgets = [(name, 1e3 * s, "#b5b5b5", ":", 0) for name, s in BUDGETS_S.items()]
    fine = ("fine FEM", 1e3 * float(fem_seconds.median()), style.look("fine_fem").colour, "-.", 1)
    for name, x, colour, dashes, end in [*budgets, fine]:
        axis.axvline(x, color=colour, ls=dashes, lw=1, zorder=1)
        axis.annotate(
            name, (x, end), (-1.5, 2 - 4 * end), xycoords=("data", "axes fraction"),
            textcoords="offset points", rotation=90, ha="right", va="top" if end else "bottom",
            fontsize=7, color="#666666",
        )  # fmt: skip


def _legend(present) -> list[Line2D]:
    """Return the handles of every method in table order, then of the front."""
    handles = [
        Line2D(
            [],
            [],
            ls="",
            marker=look.marker,
            color=look.colour,
            ms=9 if look.marker == "*" else 6,
            label=look.label,
        )
        for method, look in style.METHODS.items()
        if method in set(present)
    ]
    return [*handles, Line2D([], [], color=style.INK, lw=1, label="Pareto front")]
