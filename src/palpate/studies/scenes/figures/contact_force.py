"""Force on an instrument and its depth over time, and force over depth."""

import pandas as pd
from matplotlib.figure import Figure

from palpate.report import style, tables

TABLES = ("contact_force",)
_PARTS = (
    ("force_x_n", "x", "#56b4e9"),
    ("force_y_n", "y", "#e69f00"),
    ("force_z_n", "z", "#009e73"),
)
_ROW = 4.2
"""[inch]"""


@style.styled
def draw(contact_force: pd.DataFrame, *, scene: str) -> Figure:
    """Draw for each instrument its force and depth below the surface at rest over time, and its force over depth.

    An instrument without a depth has its force only; a scene in which no instrument moves has a panel with a note.

    contact_force : the table of this name, which may have no rows
    """
    felt = tables.where(contact_force, scene=scene)
    names = list(dict.fromkeys(felt["instrument"]))
    if not names:
        return _nothing(scene)
    figure = Figure(figsize=(9.5, _ROW * len(names)), layout="constrained")
    for part, name in zip(figure.subfigures(len(names), squeeze=False)[:, 0], names, strict=True):
        rows = tables.where(felt, instrument=name)
        title = f"{scene}: force on the {name}"
        if rows["depth_m"].notna().any():
            _with_depth(part, rows, title)
        else:
            force = part.subplots()
            _force(force, rows, f"{title}, which has no depth")
            force.set(xlabel="time [s]")
    return figure


def _with_depth(part, rows: pd.DataFrame, title: str) -> None:
    grid = part.add_gridspec(2, 2, width_ratios=[1.7, 1], height_ratios=[2, 1])
    force, depth, loop = (part.add_subplot(grid[where]) for where in ((0, 0), (1, 0), (slice(None), 1)))
    _force(force, rows, title)
    force.sharex(depth)
    force.tick_params(labelbottom=False)
    t, millimetres = rows["time_s"], 1e3 * rows["depth_m"]
    depth.fill_between(t, 0.0, millimetres.clip(lower=0.0), color="#d9d4cf")
    depth.plot(t, millimetres, color=style.INK)
    depth.set(xlabel="time [s]", ylabel="depth [mm]")
    depth.margins(x=0.0)
    touched = rows["force_n"] > 0.0
    loop.plot(millimetres, rows["force_n"], color=style.FAINT, lw=0.8)
    dots = loop.scatter(millimetres[touched], rows["force_n"][touched], c=t[touched], cmap="viridis", s=14, zorder=3)
    if touched.any():
        part.colorbar(dots, ax=loop, label="time [s]", shrink=0.8)
    loop.set(title="force over depth", xlabel="depth below the surface at rest [mm]", ylabel="force [N]")


def _force(axis, rows: pd.DataFrame, title: str) -> None:
    """Draw magnitude and components over time, with the legend beside the panel."""
    axis.plot(rows["time_s"], rows["force_n"], color=style.INK, lw=2, label="magnitude")
    for column, label, colour in _PARTS:
        axis.plot(rows["time_s"], rows[column], color=colour, label=label)
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axis.set(title=title, ylabel="force [N]")
    axis.margins(x=0.0)


def _nothing(scene: str) -> Figure:
    figure = Figure(figsize=(9.5, 1.2), layout="constrained")
    axis = figure.add_subplot()
    axis.set_axis_off()
    axis.text(0.0, 0.5, f"{scene}: no instrument moves before the scene ends", va="center", transform=axis.transAxes)
    return figure
