"""Times of bounding structures, and the false pairs that they pass to the triangle test (paper 3, chapter 4)."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.studies.collision.figures.collision_looks import depths_of, look, ranked

TABLES = ("collision",)


@style.styled
def draw(collision) -> Figure:
    """Draw one column for each scene: query time over false pairs, and below query (hollow) and whole frame (filled).

    collision : the table of this name. Composite trees of different depths are joined by a line; a rival does not
    report the number of pairs that it tests, so its query time is a horizontal line.
    """
    table = ranked(collision)
    names, among = tables.scenes(table), depths_of(table)
    rows = table[["structure", "depths", "rival"]].drop_duplicates()
    looks = {(row.structure, row.depths): look(row.structure, row.depths, among) for row in rows.itertuples()}
    figure = Figure(figsize=(2.9 * len(names) + 1.6, 7.4), layout="constrained")
    above, below = figure.subplots(2, len(names), sharey="row", squeeze=False, height_ratios=(1.1, 1))
    for top, bottom, scene in zip(above, below, names, strict=True):
        here = tables.where(table, scene=scene)
        _accuracy(top, here, looks)
        _frames(bottom, here, looks)
        top.set_title(f"{scene.replace('_', ' ')},\n{here['triangles'].iloc[0]:,} triangles")
    above[0].set_ylabel("query [ms]")
    style.plain_log(above[0].yaxis)
    below[0].set_yticks(range(len(looks)), [shown.label for shown in looks.values()])
    below[0].set_ylim(len(looks) - 0.5, -0.5)
    handles = [_handle(shown, rival) for shown, rival in zip(looks.values(), rows["rival"], strict=True)]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


def _accuracy(axis, here, looks: dict) -> None:
    """Draw query time over false pairs in one scene."""
    counted, joined = here[~here["rival"].astype(bool)], []
    for row in here.itertuples():
        shown = looks[row.structure, row.depths]
        if row.rival:
            axis.axhline(row.query_ms, color=shown.colour, lw=1, ls=":")
            continue
        false = row.triangle_tests - row.pairs
        joined += [(false, row.query_ms)] if row.depths else []
        # stars are drawn below markers at the same place
        size, order = (10, 3) if row.depths else (5.5, 4)
        axis.plot(false, row.query_ms, shown.marker, color=shown.colour, ms=size, mec="white", mew=0.6, zorder=order)
    axis.plot(*zip(*joined, strict=True), color=style.FAINT, lw=0.8, zorder=2)
    axis.set(xscale="log", yscale="log", xlabel="false pairs tested per frame")
    false = (counted["triangle_tests"] - counted["pairs"]).clip(lower=1)
    axis.set_xlim(false.min() / 1.6, false.max() * 1.6)
    style.plain_log(axis.xaxis)


def _frames(axis, here, looks: dict) -> None:
    """Draw query and whole frame in one scene, one row for each structure."""
    order = list(looks)
    for row in here.itertuples():
        shown, y = looks[row.structure, row.depths], order.index((row.structure, row.depths))
        axis.plot([row.query_ms, row.frame_ms], [y, y], color=shown.colour, lw=1.2)
        axis.plot(row.query_ms, y, "o", color=shown.colour, mfc="white", ms=5)
        axis.plot(row.frame_ms, y, "o", color=shown.colour, ms=5)
    axis.set(xscale="log", xlabel="query and whole frame [ms]")
    style.plain_log(axis.xaxis)


def _handle(shown, rival: bool) -> Line2D:
    """Return a marker for a structure of palpate, a line for a rival."""
    drawn = {"ls": ":"} if rival else {"ls": "", "marker": shown.marker, "ms": 7}
    return Line2D([], [], color=shown.colour, label=shown.label, **drawn)
