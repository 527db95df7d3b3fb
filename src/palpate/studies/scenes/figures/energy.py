"""The energies of every scene over time, and their balance with the external work."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.studies.scenes.measurements import whole

TABLES = ("energy",)
_COLUMNS, _INCHES = 3, (3.7, 2.4)
_UNITS = (("J", 1.0), ("mJ", 1e3), ("µJ", 1e6), ("nJ", 1e9))
_FREE = "gravity_j"  # potential without a natural zero: relative to its first value
_BESIDES = ("scene", "time_s", "outer_work_j", "total_j", "gain_j")


@style.styled
def draw(energy: pd.DataFrame) -> Figure:
    """Draw one panel for each scene: every energy, their sum, and the sum minus the external work.

    energy : the table of this name. Gravity's potential is relative to the first frame. Where the sum minus the
    external work (black) rises, the scheme has created energy; where it falls, damping has dissipated it. A scene whose
    elastic effect has no energy (shape matching) has neither sum nor black line, which would be incomplete.
    """
    names = tables.scenes(energy)
    columns = min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(_INCHES[0] * columns, _INCHES[1] * rows + 0.6), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, scene in zip(grid, names, strict=False):
        _panel(axis, scene, counted(tables.where(energy, scene=scene)))
    for axis in grid[len(names) :]:
        axis.remove()
    figure.legend(handles=_legend(energy), loc="outside lower center", ncols=5)
    return figure


def counted(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the energies [J] that one scene has, and ``balance_j``: their sum minus the external work."""
    rows = rows.dropna(axis="columns", how="all").copy()
    if _FREE in rows:
        first = rows[_FREE].iloc[0]
        rows[_FREE] -= first
        rows["total_j"] -= first
    return rows.assign(balance_j=rows["total_j"] - rows.get("outer_work_j", 0.0))


def of_effects(table: pd.DataFrame) -> list[str]:
    """Return the columns of kinetic energy and of the effects' energies, in order."""
    return [c for c in table if c.endswith("_j") and c not in (*_BESIDES, "balance_j")]


def _panel(axis, scene: str, rows: pd.DataFrame) -> None:
    """Draw one scene in the unit that suits its largest energy."""
    parts = of_effects(rows)
    drawn = [*parts, *(c for c in ("total_j", "outer_work_j") if c in rows)]
    largest = float(np.nanmax(np.abs(rows[drawn].to_numpy())))
    unit, factor = next(((u, f) for u, f in _UNITS if largest * f >= 1), _UNITS[-1])
    t = rows["time_s"]
    axis.axhline(0, color=style.FAINT, lw=0.6, zorder=1)
    if whole(rows):
        axis.plot(t, factor * rows["total_j"], color="#c4c4c4", lw=4, zorder=2)
        axis.plot(t, factor * rows["balance_j"], color=style.INK, lw=1.1, zorder=4)
    else:
        note = "its elastic effect has no energy"
        axis.text(0.03, 0.96, note, transform=axis.transAxes, va="top", fontsize=7, color="#666666")
    for column in parts:
        axis.plot(t, factor * rows[column], color=style.effect_colour(column.removesuffix("_j")), zorder=3)
    if "outer_work_j" in rows and rows["outer_work_j"].any():
        axis.plot(t, factor * rows["outer_work_j"], ls="--", color=style.effect_colour("outer_work"), zorder=3)
    axis.set(title=scene, xlabel="time [s]", ylabel=f"energy [{unit}]", xlim=(t.min(), t.max()))


def _legend(energy: pd.DataFrame) -> list[Line2D]:
    """Return the handles of every energy in some scene, then of the sums; elastic effects share colour and line."""
    names: dict[str, list[str]] = {}
    for column in of_effects(energy.dropna(axis="columns", how="all")):
        name = column.removesuffix("_j")
        names.setdefault(style.effect_colour(name), []).append(name.replace("_", " "))
    return [
        *(Line2D([], [], color=colour, label=", ".join(sharing)) for colour, sharing in names.items()),
        Line2D([], [], color="#c4c4c4", lw=4, label="sum"),
        Line2D([], [], color=style.effect_colour("outer_work"), ls="--", label="external work"),
        Line2D([], [], color=style.INK, lw=1.1, label="sum − external work"),
    ]
