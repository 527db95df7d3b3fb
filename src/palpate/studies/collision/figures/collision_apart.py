"""Cost of showing that two bodies are apart, over the gap between them (paper 3, chapter 4)."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.studies.collision.figures.collision_looks import depths_of, look, ranked

TABLES = ("collision_apart",)
ROWS = {"node_tests": "tests of volumes", "query_ms": "query [ms]", "frame_ms": "refit and query [ms]"}


@style.styled
def draw(collision_apart) -> Figure:
    """Draw one row for each pair of bodies: tests, time of a query, and of a frame, over the gap.

    collision_apart : the table of this name; dotted: other libraries, which do not count their tests
    """
    table = ranked(collision_apart)
    among, pairs = depths_of(table), list(dict.fromkeys(table["bodies"]))
    figure = Figure(figsize=(11, 3.4 * len(pairs) + 0.8), layout="constrained")
    grid = figure.subplots(len(pairs), len(ROWS), sharex=True, squeeze=False)
    for axes, bodies in zip(grid, pairs, strict=True):
        here = tables.where(table, bodies=bodies)
        for axis, (column, title) in zip(axes, ROWS.items(), strict=True):
            for (structure, depths), rows in here.groupby(["structure", "depths"], sort=False):
                if rows[column].notna().all():
                    rival = bool(rows["rival"].iloc[0])
                    axis.loglog(1e3 * rows["gap_m"], rows[column], **_drawn(look(structure, depths, among), rival))
            axis.set_ylabel(title)
            style.plain_log(axis.xaxis)
            style.plain_log(axis.yaxis)
        axes[0].set_title(f"{bodies.replace('_', ' ')}, {here['triangles'].iloc[0]:,} triangles")
    for axis in grid[-1]:
        axis.set_xlabel("gap between the surfaces [mm]")
    kinds = table[["structure", "depths", "rival"]].drop_duplicates().itertuples(index=False)
    handles = [Line2D([], [], label=seen.label, **_drawn(seen, bool(rival)))
               for seen, rival in ((look(s, d, among), rival) for s, d, rival in kinds)]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _drawn(seen, rival: bool) -> dict:
    return {"color": seen.colour, "marker": seen.marker, "ms": 7 if seen.marker == "*" else 4, "lw": 1,
            "ls": ":" if rival else "-"}  # fmt: skip
