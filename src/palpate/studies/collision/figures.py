"""Figures of paper 3, chapter 4: bounding structures compared, growing, stopped early, and between bodies apart."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.model_looks import Look
from palpate.report.words import spaced
from palpate.studies.collision.compare_trees import STAGES, exponents

STRUCTURES = {
    "sphere": Look("spheres", "#d55e00", "o"),
    "aabb": Look("AABBs", "#0072b2", "s"),
    "composite": Look("composite (the paper)", "#009e73", "*"),
    "obb": Look("OBBs", "#7a3b63", "D"),
    "dop14": Look("14-DOPs", "#e6b400", "v"),
    "dop18": Look("18-DOPs", "#8a6d00", "^"),
    "obb_coal_refit": Look("coal, OBBs, refitted", "#9a9a9a", "P"),
    "obb_coal": Look("coal, OBBs, rebuilt", "#6a6a6a", "X"),
    "obb_rss_fcl": Look("python-fcl, OBB-RSS, rebuilt", "#222222", "h"),
}
"""Every structure that may occur in a table, in the order of figures."""


_DEPTHS = ("#a6dcc8", "#66c2a5", "#009e73", "#00664a", "#003b2b")  # shades of the composite trees, darker with depth


def look(structure: str, depths: str = "", among: Sequence[str] = ()) -> Look:
    """Return the look of a structure; ``depths`` give a composite tree its label, and a shade ``among`` all depths."""
    shown = STRUCTURES[structure]
    if not depths:
        return shown
    # one alone gets the middle shade
    first_shade = (len(_DEPTHS) - len(among)) // 2
    shade = _DEPTHS[min(max(first_shade, 0) + list(among).index(depths), len(_DEPTHS) - 1)] if among else shown.colour
    return Look(f"composite {depths}", shade, shown.marker)


def depths_of(table) -> list[str]:
    """Return the depths of all composite trees in a table, sorted by layers of spheres, then of both."""
    all_depths = filter(None, table["depths"].unique())
    return sorted(all_depths, key=lambda depths: [int(layers) for layers in depths.split("/")])


def ranked(table):
    """Sort the rows of a table by STRUCTURES and depths, which become text ("" where there are none)."""
    table = table.assign(depths=table["depths"].fillna("").astype(str))
    order = {"structure": list(STRUCTURES), "depths": ["", *depths_of(table)]}
    # stable sorts, so that scenes and numbers of triangles keep their order
    for column in ("depths", "structure"):
        table = table.sort_values(
            column, key=lambda values, column=column: values.map(order[column].index), kind="stable"
        )
    return table


@style.figure("collision", tables=("collision",))
def draw_collision(collision) -> Figure:
    """Draw one column for each scene: query time over false pairs, and below query (hollow) and whole frame (filled).

    Composite trees of different depths are joined by a line; a rival does not report the number of pairs that it
    tests, so its query time is a horizontal line.
    """
    table = ranked(collision)
    names, among = tables.scenes(table), depths_of(table)
    rows = table[["structure", "depths", "rival"]].drop_duplicates()
    looks = {(row.structure, row.depths): look(row.structure, row.depths, among) for row in rows.itertuples()}
    size = (2.9 * len(names) + 1.6, 7.4)
    figure, (above, below) = style.panels(2, len(names), size, sharey="row", height_ratios=(1.1, 1))
    for top, bottom, scene in zip(above, below, names, strict=True):
        of_scene = tables.where(table, scene=scene)
        _accuracy(top, of_scene, looks)
        _frames(bottom, of_scene, looks)
        top.set_title(f"{spaced(scene)},\n{of_scene['triangles'].iloc[0]:,} triangles")
    above[0].set_ylabel("query [ms]")
    style.plain_log(above[0].yaxis)
    below[0].set_yticks(range(len(looks)), [shown.label for shown in looks.values()])
    below[0].set_ylim(len(looks) - 0.5, -0.5)
    handles = []
    for shown, rival in zip(looks.values(), rows["rival"], strict=True):
        drawn: dict = {"ls": ":"} if rival else {"ls": "", "marker": shown.marker, "ms": 7}
        handles.append(Line2D([], [], color=shown.colour, label=shown.label, **drawn))
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _accuracy(axis, here, looks: dict) -> None:
    """Draw query time over false pairs of each structure in the rows ``here`` of a scene; rivals as level lines."""
    own_trees, composites = here[~here["rival"].astype(bool)], []
    for row in here.itertuples():
        shown = looks[row.structure, row.depths]
        if row.rival:
            axis.axhline(row.query_ms, color=shown.colour, lw=1, ls=":")
            continue
        false = row.triangle_tests - row.pairs
        composites += [(false, row.query_ms)] if row.depths else []
        # stars are drawn below markers at the same place
        size, order = (10, 3) if row.depths else (5.5, 4)
        axis.plot(false, row.query_ms, shown.marker, color=shown.colour, ms=size, mec="white", mew=0.6, zorder=order)
    axis.plot(*zip(*composites, strict=True), color=style.FAINT, lw=0.8, zorder=2)
    axis.set(xscale="log", yscale="log", xlabel="false pairs tested per frame")
    false = (own_trees["triangle_tests"] - own_trees["pairs"]).clip(lower=1)
    axis.set_xlim(false.min() / 1.6, false.max() * 1.6)
    style.plain_log(axis.xaxis)


def _frames(axis, here, looks: dict) -> None:
    order = list(looks)
    for row in here.itertuples():
        shown, y = looks[row.structure, row.depths], order.index((row.structure, row.depths))
        axis.plot([row.query_ms, row.frame_ms], [y, y], color=shown.colour, lw=1.2)
        axis.plot(row.query_ms, y, "o", color=shown.colour, mfc="white", ms=5)
        axis.plot(row.frame_ms, y, "o", color=shown.colour, ms=5)
    axis.set(xscale="log", xlabel="query and whole frame [ms]")
    style.plain_log(axis.xaxis)


@style.figure("collision_scaling", tables=("collision_scaling",))
def draw_collision_scaling(collision_scaling) -> Figure:
    """Draw one panel for each stage, one curve with its exponent for each structure; dotted: proportional to n."""
    table = ranked(collision_scaling)
    among, powers = depths_of(table), exponents(table).set_index(["structure", "depths"])
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    for axis, stage in zip(figure.subplots(1, len(STAGES), sharey=True), STAGES, strict=True):
        for (structure, depths), rows in table.dropna(subset=stage).groupby(["structure", "depths"], sort=False):
            shown = look(structure, depths, among)
            label = style.with_power(shown.label, powers.loc[(structure, depths), stage])
            axis.loglog(rows["triangles"], rows[stage], label=label, **_drawn(shown))
        ends = np.array([table["triangles"].min(), table["triangles"].max()])
        axis.loglog(ends, 1e-4 * ends, color=style.FAINT, lw=0.8, ls=":", label="100 ns per triangle")
        axis.set(title=stage.removesuffix("_ms"), xlabel="triangles, n")
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=7.5, ncols=2)
        style.plain_log(axis.xaxis, axis.yaxis)
    figure.axes[0].set_ylabel("time for two bodies on one core [ms]")
    return figure


ERRORS = {
    "response_error_m": "error of the response [mm]",
    "place_error_m": "error of the place [mm]",
    "reported_m": "contact reported\nat a distance of up to [mm]",
}
LEAST_MM = 0.01  # errors below are drawn here: nothing of an organ is known better


@style.figure("collision_precision", tables=("collision_precision",))
def draw_collision_precision(collision_precision) -> Figure:
    """Draw one column for each scene, errors over the time of a frame, one curve for each structure.

    Small numbers are the coarsest and the finest layer; a large open marker is the whole tree with tests of triangles.
    Dotted: the response itself. A panel is empty where bodies never touch, or always do.
    """
    table = ranked(collision_precision)
    names, among = tables.scenes(table), depths_of(table)
    figure, grid = style.panels(len(ERRORS), len(names), (3.0 * len(names) + 0.6, 8.2), sharey="row")
    for column, scene in zip(grid.T, names, strict=True):
        of_scene = tables.where(table, scene=scene)
        column[0].set_title(f"{spaced(scene)},\n{of_scene['triangles'].iloc[0]:,} triangles")
        for axis, error in zip(column, ERRORS, strict=True):
            _curves(axis, of_scene, error, among)
        response_mm = 1e3 * of_scene["response_m"].iloc[0]
        if response_mm > 0.0:
            column[0].axhline(response_mm, color=style.FAINT, lw=1, ls=":")
        column[-1].set_xlabel("refit and contacts of a frame [ms]")
    for axis, title in zip(grid[:, 0], ERRORS.values(), strict=True):
        axis.set_ylabel(title)
        # panels of a row share it, and one without numbers has set it anew
        style.plain_log(axis.yaxis)
    shown = table[["structure", "depths"]].drop_duplicates().itertuples(index=False)
    looks = [look(structure, depths, among) for structure, depths in shown]
    handles = [Line2D([], [], color=seen.colour, marker=seen.marker, ms=6, lw=1, label=seen.label) for seen in looks]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _curves(axis, here, error: str, among: list[str]) -> None:
    """Draw a column ``error`` over the time of a frame in the rows ``here`` of a scene, a curve for each structure."""
    axis.set(xscale="log", yscale="log")
    if (error == "reported_m" and not here["frames_apart"].any()) or here[error].isna().all():
        why = "never apart" if error == "reported_m" else "never in contact"
        axis.text(0.5, 0.5, why, ha="center", va="center", transform=axis.transAxes, color=style.FAINT)
        axis.set_xlim(0.9 * here["frame_ms"].min(), 1.1 * here["frame_ms"].max())
        style.plain_log(axis.xaxis)
        return
    for (structure, depths), rows in here.groupby(["structure", "depths"], sort=False):
        seen = look(structure, depths, among)
        stopped, whole = (rows[rows["exact"].astype(bool) == exact] for exact in (False, True))
        stopped = stopped.sort_values("layer")
        values = np.maximum(1e3 * stopped[error], LEAST_MM)
        axis.plot(stopped["frame_ms"], values, **_drawn(seen))
        if structure == "aabb":
            for end in (stopped["layer"].idxmin(), stopped["layer"].idxmax()):
                place = (stopped["frame_ms"][end], values[end])
                axis.annotate(f"{stopped['layer'][end]:g}", place, (-5, -9), textcoords="offset points", fontsize=6.5)
        errors = np.maximum(1e3 * whole[error], LEAST_MM)
        axis.plot(whole["frame_ms"], errors, marker=seen.marker, ms=9, ls="", mfc="none", color=seen.colour)
    style.plain_log(axis.xaxis)


COSTS = {"node_tests": "tests of volumes", "query_ms": "query [ms]", "frame_ms": "refit and query [ms]"}


@style.figure("collision_apart", tables=("collision_apart",))
def draw_collision_apart(collision_apart) -> Figure:
    """Draw one row for each pair of bodies: tests, time of a query, and of a frame, over the gap.

    Dotted: other libraries, which do not count their tests.
    """
    table = ranked(collision_apart)
    among, pairs = depths_of(table), list(dict.fromkeys(table["bodies"]))
    figure, grid = style.panels(len(pairs), len(COSTS), (11, 3.4 * len(pairs) + 0.8), sharex=True)
    for axes, bodies in zip(grid, pairs, strict=True):
        of_bodies = tables.where(table, bodies=bodies)
        for axis, (column, title) in zip(axes, COSTS.items(), strict=True):
            for (structure, depths), rows in of_bodies.groupby(["structure", "depths"], sort=False):
                if rows[column].notna().all():
                    rival = bool(rows["rival"].iloc[0])
                    axis.loglog(1e3 * rows["gap_m"], rows[column], **_drawn(look(structure, depths, among), rival))
            axis.set_ylabel(title)
            style.plain_log(axis.xaxis, axis.yaxis)
        axes[0].set_title(f"{spaced(bodies)}, {of_bodies['triangles'].iloc[0]:,} triangles")
    for axis in grid[-1]:
        axis.set_xlabel("gap between the surfaces [mm]")
    handles = []
    for row in table[["structure", "depths", "rival"]].drop_duplicates().itertuples():
        seen = look(row.structure, row.depths, among)
        handles.append(Line2D([], [], label=seen.label, **_drawn(seen, bool(row.rival))))
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _drawn(seen: Look, rival: bool = False) -> dict:
    size = 8 if seen.marker == "*" else 4
    return {"color": seen.colour, "marker": seen.marker, "ms": size, "lw": 1, "ls": ":" if rival else "-"}
