"""Draw how well the truth of each scene is known, and the order in which quadratic elements converge to it."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.studies.tradeoff.figures.scene_rows import KNOWN

TABLES = ("truth",)
COLUMNS = {
    "rmse_of_peak": ("over the surface, RMSE of peak", "#0072b2", "o"),
    "patch_rms_of_peak": ("at the patch, RMS of peak", "#d55e00", "s"),
    "relative_l2": ("relative L2", "#9a9a9a", "D"),
}
"""The errors of the truth itself: name, colour and marker."""
SMOOTH = 3
"""Order of quadratic elements where nothing is singular."""


@style.styled
def draw(truth) -> Figure:
    """Draw the truth's own errors of each scene, and its order of convergence beside them; a row per scene.

    truth : the table of this name
    Points are means over the samples; lines reach to the worst sample, and over the orders of all samples. Crosses are
    those which only choose settings. Where another element was tried, its distance is joined to the truth's own error
    on the same samples. Triangles are what the body's facets change, where its smooth surface is known.
    """
    names = tables.scenes(truth)
    figure = Figure(figsize=(9.5, 1.5 + 0.36 * len(names)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[3, 2])
    rows = np.arange(len(names))
    for i, (column, (name, colour, marker)) in enumerate(COLUMNS.items()):
        place = rows + 0.16 * (i - 1)
        most = truth.get(f"{column}_max", truth[column])
        left.hlines(place, 100 * truth[column], 100 * most, color=colour, lw=1.2, alpha=0.5, zorder=2)
        left.plot(100 * truth[column], place, marker, color=colour, mec="white", mew=0.5, ms=6, label=name, zorder=3)
    _less_known(left, truth, rows)
    _other_element(left, truth, rows)
    _facets(left, truth, rows)
    left.axvline(100 * KNOWN, color="#aa0000", lw=1, ls=(0, (4, 2)), zorder=1)
    left.set(xscale="log", xlabel="error of the truth itself [%]", title="how well the truth is known")
    left.set_yticks(rows, [scene.replace("_", " ") for scene in names])
    left.set_ylim(len(names) - 0.5, -0.5)
    low, high = left.get_xlim()
    left.set_xlim(low, max(high, 130 * KNOWN))
    style.plain_log(left.xaxis)
    right.axvline(SMOOTH, color="#aaaaaa", lw=1, ls=":", zorder=0)
    if {"ratio_min", "ratio_max"} <= set(truth):
        ends = [np.log2(truth[name]) for name in ("ratio_min", "ratio_max")]
        right.hlines(rows, *ends, color=style.INK, lw=2.5, alpha=0.3, zorder=1)
    right.plot(truth["order"], rows, "o", color=style.INK, ms=6, zorder=2)
    right.set(xlabel="order of convergence", title="how fast quadratic elements converge")
    right.set_xlim(min(0.8, right.get_xlim()[0]), max(3.2, right.get_xlim()[1]))
    for axis in (left, right):
        axis.grid(axis="y", visible=False)
    limit = Line2D(
        [], [], color="#aa0000", lw=1, ls=(0, (4, 2)), label=f"{100 * KNOWN:g} %: beyond, the diagram says so"
    )
    smooth = Line2D([], [], color="#aaaaaa", lw=1, ls=":", label=f"order {SMOOTH}: smooth solutions")
    handles = [*left.get_legend_handles_labels()[0], limit, smooth]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _less_known(axis, truth, rows: np.ndarray) -> None:
    """Draw the truth's own errors on samples that only choose settings, where these do without the finest level."""
    name = "on validation samples, which have one level less"
    for i, (column, (_, colour, _)) in enumerate(COLUMNS.items()):
        values = truth.get(f"validation_{column}")
        if values is not None and values.notna().any():
            place = rows + 0.16 * (i - 1)
            axis.plot(100 * values, place, "x", color=colour, ms=5, label="" if i else name, zorder=3)


def _other_element(axis, truth, rows: np.ndarray) -> None:
    """Draw how far the limit of linear elements is, with a line from the truth's own error on the same samples."""
    name = "distance of the limit of linear elements, from the own error of the same samples"
    for place, ending, colour in ((-0.28, "", "#0072b2"), (0.28, "_patch", "#d55e00")):
        if f"other_element{ending}" not in truth or truth[f"other_element{ending}"].isna().all():
            continue
        found = 100 * truth[f"other_element{ending}"]
        axis.plot(found, rows + place, "o", mfc="none", mec=colour, ms=5, label="" if ending else name, zorder=3)
        if f"other_element_own{ending}" in truth:
            own = 100 * truth[f"other_element_own{ending}"]
            axis.hlines(rows + place, own, found, color=colour, lw=0.8, zorder=2)
            axis.plot(own, rows + place, "|", color=colour, ms=6, zorder=3)


def _facets(axis, truth, rows: np.ndarray) -> None:
    """Draw how far the answers of a body of facets and of one on the smooth surface are apart."""
    name = "what facets change, beside the smooth shape"
    for place, column, colour in ((-0.16, "geometry_of_peak", "#0072b2"), (0.0, "geometry_patch_of_peak", "#d55e00")):
        values = truth.get(column)
        if values is not None and values.notna().any():
            label = name if column == "geometry_of_peak" else ""
            axis.plot(100 * values, rows + place, "^", mfc="none", mec=colour, ms=6, label=label, zorder=3)
