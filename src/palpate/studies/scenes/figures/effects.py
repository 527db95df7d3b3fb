"""Time of each effect of a scene per step, and the scene's error without it."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from palpate.report import style, tables
from palpate.report.number_format import percent, seconds

TABLES = ("effects",)
_INCHES, _ROW = 9.0, 0.27
_LEAST = 1e-4  # smaller errors are drawn here, so that an error near zero does not stretch the axis


@style.styled
def draw(effects: pd.DataFrame) -> Figure:
    """Draw one row of panels for each scene: the time per step, and beside it the error if the effect is left out.

    effects : the table of this name. The error is the root mean square over frames and nodes, as a share of the
    largest displacement; effects without one (the elastic one, the integrator, runs that fail) have a dash.
    """
    names = tables.scenes(effects)
    parts = [tables.where(effects, scene=scene) for scene in names]
    counts = [len(rows) for rows in parts]
    height = _ROW * sum(counts) + 0.5 * len(names) + 0.45
    figure = Figure(figsize=(_INCHES, height), layout="constrained")
    grid = figure.subplots(
        len(names), 2, squeeze=False, sharey="row", height_ratios=[_ROW * n + 0.2 for n in counts], width_ratios=[3, 2]
    )
    finite = effects["error_if_left_out"].replace([np.inf, -np.inf], np.nan)
    top = max(1.0, 3 * float(np.nan_to_num(finite.max())))
    for (left, right), scene, rows in zip(grid, names, parts, strict=True):
        _bars(left, rows)
        _dots(right, rows, top)
        left.set_title(scene)
    grid[-1, 0].set_xlabel("time per step [ms]")
    grid[0, 1].set_title("error if left out [% of peak]")
    return figure


def _bars(axis, rows: pd.DataFrame) -> None:
    """Draw the milliseconds per step in table order, with their share of the step."""
    longest = rows["ms_per_step"].max()
    for y, row in enumerate(rows.itertuples()):
        axis.barh(y, row.ms_per_step, color=style.effect_colour(row.effect), height=0.7)
        text = f"{seconds(1e-3 * row.ms_per_step)}, {percent(row.share_of_step)}"
        axis.annotate(text, (row.ms_per_step, y), (4, 0), textcoords="offset points", va="center", fontsize=7)
    axis.set_yticks(range(len(rows)), [name.replace("_", " ") for name in rows["effect"]])
    axis.set(xlim=(0, 1.3 * longest), ylim=(len(rows) - 0.5, -0.5))
    axis.grid(axis="y", visible=False)


def _dots(axis, rows: pd.DataFrame, top: float) -> None:
    """Draw the errors on a logarithmic scale that all scenes share."""
    for y, row in enumerate(rows.itertuples()):
        error = row.error_if_left_out
        if np.isfinite(error):
            drawn = 100 * max(error, _LEAST)
            axis.plot([100 * _LEAST, drawn], [y, y], color="#cccccc", lw=1, zorder=2)
            axis.plot(drawn, y, "o", color=style.effect_colour(row.effect), mec=style.INK, mew=0.5, ms=6, zorder=3)
            axis.annotate(percent(error), (drawn, y), (6, 0), textcoords="offset points", va="center", fontsize=7)
        else:
            axis.annotate("–", (100 * _LEAST, y), (6, 0), textcoords="offset points", va="center", color="#666666")
    axis.set(xscale="log", xlim=(100 * _LEAST, 1000 * top))
    axis.xaxis.set_major_locator(LogLocator(numticks=20))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.minorticks_off()
    axis.grid(axis="y", visible=False)
    axis.tick_params(axis="y", left=False, labelleft=False)
