"""Energies of scenes, cost of their effects, and force on instruments."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from palpate.report import style, tables
from palpate.report.words import percent, seconds, spaced
from palpate.studies.scenes.measurements import whole

_UNITS = (("J", 1.0), ("mJ", 1e3), ("µJ", 1e6), ("nJ", 1e9))
_FREE = "gravity_j"  # potential without a natural zero: relative to its first value
_BESIDES = ("scene", "time_s", "outer_work_j", "total_j", "gain_j")


@style.figure("energy", tables=("energy",))
def draw_energy(energy: pd.DataFrame) -> Figure:
    """Draw one panel for each scene: every energy, their sum, and the sum minus the external work.

    energy : the table of this name. Gravity's potential is relative to the first frame. Where the sum minus the
    external work (black) rises, the scheme has created energy; where it falls, damping has dissipated it. A scene whose
    elastic effect has no energy (shape matching) has neither sum nor black line, which would be incomplete.
    """
    figure, axes = style.panel_each(tables.scenes(energy), 3, 3.7, 2.4)
    for scene, axis in axes.items():
        _panel(axis, scene, counted(tables.where(energy, scene=scene)))
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
    """Draw the energies of one scene (``rows`` of the table energy) over time, in the unit that suits the largest."""
    energies = of_effects(rows)
    columns = [*energies, *(c for c in ("total_j", "outer_work_j") if c in rows)]
    largest = float(np.nanmax(np.abs(rows[columns].to_numpy())))
    unit, factor = next(((name, per_joule) for name, per_joule in _UNITS if largest * per_joule >= 1), _UNITS[-1])
    t = rows["time_s"]
    axis.axhline(0, color=style.FAINT, lw=0.6, zorder=1)
    if whole(rows):
        axis.plot(t, factor * rows["total_j"], color="#c4c4c4", lw=4, zorder=2)
        axis.plot(t, factor * rows["balance_j"], color=style.INK, lw=1.1, zorder=4)
    for column in energies:
        axis.plot(t, factor * rows[column], color=style.effect_colour(column.removesuffix("_j")), zorder=3)
    if "outer_work_j" in rows and rows["outer_work_j"].any():
        axis.plot(t, factor * rows["outer_work_j"], ls="--", color=style.effect_colour("outer_work"), zorder=3)
    title = scene if whole(rows) else f"{scene}, elastic energy not defined"
    axis.set(title=title, xlabel="time [s]", ylabel=f"energy [{unit}]", xlim=(t.min(), t.max()))


def _legend(energy: pd.DataFrame) -> list[Line2D]:
    """Return a handle for each colour of energies in any scene, labelled with their names, then those of the sums."""
    names_by_colour: dict[str, list[str]] = {}
    for column in of_effects(energy.dropna(axis="columns", how="all")):
        name = column.removesuffix("_j")
        names_by_colour.setdefault(style.effect_colour(name), []).append(spaced(name))
    return [
        *(Line2D([], [], color=colour, label=", ".join(names)) for colour, names in names_by_colour.items()),
        Line2D([], [], color="#c4c4c4", lw=4, label="sum"),
        Line2D([], [], color=style.effect_colour("outer_work"), ls="--", label="external work"),
        Line2D([], [], color=style.INK, lw=1.1, label="sum − external work"),
    ]


_BAR_INCHES = 0.27
_LEAST = 1e-4  # smaller errors are drawn here, so that an error near zero does not stretch the axis


@style.figure("effects", tables=("effects",))
def draw_effects(effects: pd.DataFrame) -> Figure:
    """Draw one row of panels for each scene: the time per step, and beside it the error if the effect is left out.

    effects : the table of this name. The error is the root mean square over frames and nodes, as a share of the
    largest displacement; effects without one (the elastic one, the integrator, runs that fail) have a dash.
    """
    scenes = tables.scenes(effects)
    tables_by_scene = [tables.where(effects, scene=scene) for scene in scenes]
    bars = [len(rows) for rows in tables_by_scene]
    height = _BAR_INCHES * sum(bars) + 0.5 * len(scenes) + 0.45
    figure = Figure(figsize=(9.0, height), layout="constrained")
    heights = [_BAR_INCHES * count + 0.2 for count in bars]
    grid = figure.subplots(len(scenes), 2, squeeze=False, sharey="row", height_ratios=heights, width_ratios=[3, 2])
    finite = effects["error_if_left_out"].replace([np.inf, -np.inf], np.nan)
    largest_error = max(1.0, 3 * float(np.nan_to_num(finite.max())))
    for (left, right), scene, rows in zip(grid, scenes, tables_by_scene, strict=True):
        _bars(left, rows)
        _dots(right, rows, largest_error)
        left.set_title(scene)
    grid[-1, 0].set_xlabel("time per step [ms]")
    grid[0, 1].set_title("error if left out [% of peak]")
    return figure


def _bars(axis, rows: pd.DataFrame) -> None:
    longest = rows["ms_per_step"].max()
    for y, row in enumerate(rows.itertuples()):
        axis.barh(y, row.ms_per_step, color=style.effect_colour(row.effect), height=0.7)
        text = f"{seconds(1e-3 * row.ms_per_step)}, {percent(row.share_of_step)}"
        axis.annotate(text, (row.ms_per_step, y), (4, 0), textcoords="offset points", va="center", fontsize=7)
    axis.set_yticks(range(len(rows)), [spaced(name) for name in rows["effect"]])
    axis.set(xlim=(0, 1.3 * longest), ylim=(len(rows) - 0.5, -0.5))
    axis.grid(axis="y", visible=False)


def _dots(axis, rows: pd.DataFrame, largest: float) -> None:
    """Draw a dot for each effect's error on one logarithmic scale, from _LEAST to ``largest``; a dash for none."""
    for y, row in enumerate(rows.itertuples()):
        error = row.error_if_left_out
        if np.isfinite(error):
            shown = 100 * max(error, _LEAST)
            axis.plot([100 * _LEAST, shown], [y, y], color="#cccccc", lw=1, zorder=2)
            axis.plot(shown, y, "o", color=style.effect_colour(row.effect), mec=style.INK, mew=0.5, ms=6, zorder=3)
            axis.annotate(percent(error), (shown, y), (6, 0), textcoords="offset points", va="center", fontsize=7)
        else:
            axis.annotate("–", (100 * _LEAST, y), (6, 0), textcoords="offset points", va="center", color="#666666")
    axis.set(xscale="log", xlim=(100 * _LEAST, 1000 * largest))
    axis.xaxis.set_major_locator(LogLocator(numticks=6))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.minorticks_off()
    axis.grid(axis="y", visible=False)
    axis.tick_params(axis="y", left=False, labelleft=False)


@style.figure("contact_force", tables=("contact_force",))
def draw_contact_force(contact_force: pd.DataFrame, *, scene: str) -> Figure:
    """Draw for each instrument its force and depth below the surface at rest over time, and its force over depth.

    An instrument without a depth has its force only; a scene in which no instrument moves has a panel with a note.

    contact_force : the table of this name, which may have no rows
    """
    forces = tables.where(contact_force, scene=scene)
    names = list(dict.fromkeys(forces["instrument"]))
    if not names:
        figure = Figure(figsize=(9.5, 1.2), layout="constrained")
        axis, note = figure.add_subplot(), f"{scene}: no instrument moves before the scene ends"
        axis.set_axis_off()
        axis.text(0.0, 0.5, note, va="center", transform=axis.transAxes)
        return figure
    figure = Figure(figsize=(9.5, 4.2 * len(names)), layout="constrained")
    for panel, name in zip(figure.subfigures(len(names), squeeze=False)[:, 0], names, strict=True):
        rows = tables.where(forces, instrument=name)
        title = f"{scene}: force on the {spaced(name)}"
        if rows["depth_m"].notna().any():
            _with_depth(panel, rows, title)
        else:
            force = panel.subplots()
            _force(force, rows, f"{title}, which has no depth")
            force.set(xlabel="time [s]")
    return figure


def _with_depth(panel, rows: pd.DataFrame, title: str) -> None:
    """Draw force and depth of one instrument over time in ``panel``, and beside them the force over the depth."""
    grid = panel.add_gridspec(2, 2, width_ratios=[1.7, 1], height_ratios=[2, 1])
    force_axis, depth_axis, cycle = (panel.add_subplot(grid[cell]) for cell in ((0, 0), (1, 0), (slice(None), 1)))
    _force(force_axis, rows, title)
    force_axis.sharex(depth_axis)
    force_axis.tick_params(labelbottom=False)
    t, millimetres = rows["time_s"], 1e3 * rows["depth_m"]
    depth_axis.fill_between(t, 0.0, millimetres.clip(lower=0.0), color="#d9d4cf")
    depth_axis.plot(t, millimetres, color=style.INK)
    depth_axis.set(xlabel="time [s]", ylabel="depth [mm]")
    depth_axis.margins(x=0.0)
    touched = rows["force_n"] > 0.0
    cycle.plot(millimetres, rows["force_n"], color=style.FAINT, lw=0.8)
    dots = cycle.scatter(millimetres[touched], rows["force_n"][touched], c=t[touched], cmap="viridis", s=14, zorder=3)
    if touched.any():
        panel.colorbar(dots, ax=cycle, label="time [s]", shrink=0.8)
    cycle.set(title="force over depth", xlabel="depth below the surface at rest [mm]", ylabel="force [N]")


def _force(axis, rows: pd.DataFrame, title: str) -> None:
    """Draw magnitude and components over time, with the legend beside the panel."""
    axis.plot(rows["time_s"], rows["force_n"], color=style.INK, lw=2, label="magnitude")
    for component, colour in {"x": "#56b4e9", "y": "#e69f00", "z": "#009e73"}.items():
        axis.plot(rows["time_s"], rows[f"force_{component}_n"], color=colour, label=component)
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axis.set(title=title, ylabel="force [N]")
    axis.margins(x=0.0)
