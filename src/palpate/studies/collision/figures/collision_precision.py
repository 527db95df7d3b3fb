"""Errors of contacts from bounding trees over the layer at which they are stopped (paper 3, chapter 4)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.studies.collision.figures.collision_looks import depths_of, look, ranked

TABLES = ("collision_precision",)
ROWS = {
    "response_error_m": "error of the response [mm]",
    "place_error_m": "error of the place [mm]",
    "reported_m": "contact reported\nat a distance of up to [mm]",
}
LEAST_MM = 0.01
"""Errors below are drawn here: nothing of an organ is known better."""


@style.styled
def draw(collision_precision) -> Figure:
    """Draw one column for each scene, errors over the time of a frame, one curve for each structure.

    collision_precision : the table of this name. Small numbers are layers; a large open marker is the whole tree with
    tests of triangles. Dotted: the response itself. A panel is empty where bodies never touch, or always do.
    """
    table = ranked(collision_precision)
    names, among = tables.scenes(table), depths_of(table)
    figure = Figure(figsize=(3.0 * len(names) + 0.6, 8.2), layout="constrained")
    grid = figure.subplots(len(ROWS), len(names), sharey="row", squeeze=False)
    for column, scene in zip(grid.T, names, strict=True):
        here = tables.where(table, scene=scene)
        column[0].set_title(f"{scene.replace('_', ' ')},\n{here['triangles'].iloc[0]:,} triangles")
        for axis, error in zip(column, ROWS, strict=True):
            _curves(axis, here, error, among)
        wanted = 1e3 * here["response_m"].iloc[0]
        if wanted > 0.0:
            column[0].axhline(wanted, color=style.FAINT, lw=1, ls=":")
        column[-1].set_xlabel("refit and contacts of a frame [ms]")
    for axis, title in zip(grid[:, 0], ROWS.values(), strict=True):
        axis.set_ylabel(title)
        # panels of a row share it, and one without numbers has set it anew
        style.plain_log(axis.yaxis)
    shown = table[["structure", "depths"]].drop_duplicates().itertuples(index=False)
    handles = [_handle(look(structure, depths, among)) for structure, depths in shown]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _curves(axis, here, error: str, among: list[str]) -> None:
    """Draw one error in one scene."""
    axis.set(xscale="log", yscale="log")
    if (error == "reported_m" and not here["frames_apart"].any()) or here[error].isna().all():
        axis.text(0.5, 0.5, "never apart" if error == "reported_m" else "never in contact", ha="center", va="center",
                  transform=axis.transAxes, color=style.FAINT)  # fmt: skip
        axis.set_xlim(0.9 * here["frame_ms"].min(), 1.1 * here["frame_ms"].max())
        style.plain_log(axis.xaxis)
        return
    for (structure, depths), rows in here.groupby(["structure", "depths"], sort=False):
        seen = look(structure, depths, among)
        stopped, whole = (rows[rows["exact"].astype(bool) == exact] for exact in (False, True))
        stopped = stopped.sort_values("layer")
        values = np.maximum(1e3 * stopped[error], LEAST_MM)
        size = 7 if seen.marker == "*" else 4
        axis.plot(stopped["frame_ms"], values, marker=seen.marker, ms=size, lw=1, color=seen.colour)
        if structure == "aabb":
            for layer, x, y in zip(stopped["layer"], stopped["frame_ms"], values, strict=True):
                axis.annotate(f"{layer:g}", (x, y), xytext=(3, 3), textcoords="offset points", fontsize=6.5)
        ends = np.maximum(1e3 * whole[error], LEAST_MM)
        axis.plot(whole["frame_ms"], ends, marker=seen.marker, ms=9, ls="", mfc="none", color=seen.colour)
    style.plain_log(axis.xaxis)


def _handle(seen) -> Line2D:
    return Line2D([], [], color=seen.colour, marker=seen.marker, ms=6, lw=1, label=seen.label)
