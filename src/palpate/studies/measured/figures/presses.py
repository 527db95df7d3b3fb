"""Presses of one entry: forces as measured and fitted, errors of what was left out, and the spread over the places."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.report.turnable import evenly
from palpate.report.words import spaced
from palpate.studies.measured.figures.bars import figure_of_errors

WAYS = {"place": "places", "depth": "the deeper half", "session": "session", "specimen": "specimen"}
RIVALS = {
    "power_law": "power law", "line": "straight line", "power_law_of_place": "power law, of the press alone",
    "line_of_place": "straight line, of the press alone", "repeat": "a repeat (floor)",
    "neighbour": "the nearest place (floor)",
}  # fmt: skip
FLOORS = ("repeat", "neighbour")
SHOWN = 9
"""Presses that are drawn, spread over the strength of their forces."""
FAR_APART = 5.0
"""Largest over least force from which on their colours are those of a logarithm."""


@style.figure("presses", tables=("press_curves", "press_predictions"))
def draw_presses(press_curves, press_predictions, *, scene: str) -> Figure:
    """Draw what was measured and what follows, of all parts of one entry."""
    curves = tables.where(press_curves, entry=scene)
    errors = tables.where(press_predictions, entry=scene)
    laws = [name for name in dict.fromkeys(errors["model"]) if name not in RIVALS]
    names = {law: spaced(law) for law in laws} | RIVALS
    figure, grid = figure_of_errors(errors, "by", "error_share", WAYS, names, FLOORS, "of force")
    _forces(figure.add_subplot(grid[0, 0]), curves)
    _places(figure, figure.add_subplot(grid[1, 0]), curves)
    return figure


def _forces(axis: Axes, curves: pd.DataFrame) -> None:
    """Draw force over depth of SHOWN presses, spread over their strength: as measured, and as fitted with errors."""
    strength = curves.groupby(["part", "press"], sort=False)["measured_n"].max().sort_values()
    chosen = strength.index[evenly(len(strength), SHOWN)]
    for number, (part, press) in enumerate(chosen):
        rows = curves[curves["part"].eq(part) & curves["press"].eq(press)]
        x, label = 1e3 * rows["depth_m"], ("measured", "fitted, with errors of 90 %") if number == 0 else (None, None)
        axis.fill_between(x, rows["low_n"], rows["high_n"], color="#d55e00", alpha=0.15, lw=0)
        axis.plot(x, rows["fitted_n"], color="#d55e00", lw=1.0, label=label[1])
        axis.plot(x, rows["measured_n"], "o", ms=3, color="#0072b2", label=label[0])
    axis.set(
        xlabel="depth since first touch [mm]", ylabel="force [N]", title=f"{len(chosen)} of {len(strength)} presses"
    )
    axis.legend(loc="upper left")


def _places(figure: Figure, axis: Axes, curves: pd.DataFrame) -> None:
    """Draw the fitted force at a depth that nine tenths of the presses reach, over the places of the last part."""
    deepest = curves.groupby(["part", "press"])["depth_m"].max()
    depth = float(deepest.quantile(0.1))
    forces = []
    for (part, _), rows in curves.groupby(["part", "press"], sort=False):
        if rows["depth_m"].max() >= depth and rows["x_m"].notna().all():
            force = np.interp(depth, rows["depth_m"], rows["fitted_n"])
            forces.append((part, 1e3 * rows["x_m"].iloc[0], 1e3 * rows["y_m"].iloc[0], force))
    if not forces:
        axis.set_visible(False)
        return
    name = forces[-1][0]
    x, y, force = np.array([row[1:] for row in forces if row[0] == name], dtype=float).T
    force = np.maximum(force, 1e-3 * force.max())
    norm = "log" if force.max() > FAR_APART * force.min() else "linear"
    drawn = axis.scatter(x, y, c=force, cmap=style.DISPLACEMENT, norm=norm, s=30, edgecolors=style.FAINT, lw=0.5)
    axis.margins(0.1)
    figure.colorbar(drawn, ax=axis, label=f"force at {1e3 * depth:.2g} mm [N]")
    axis.set(xlabel="[mm]", ylabel="[mm]", title=f"places{f' of {name}' if name != 'all' else ''}", aspect="equal")
