"""Draw how well truths are known, what bounds of single answers are worth, and where the law has limit points."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.benchmark.conformal import LEVEL
from palpate.benchmark.presses import PRESSURE
from palpate.report import style, tables
from palpate.report.words import spaced
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, jumps

COLUMNS = {
    "rmse_of_peak": ("over the surface, RMSE of peak", "#0072b2", "o"),
    "patch_rms_of_peak": ("at the patch, RMS of peak", "#d55e00", "s"),
    "relative_l2": ("relative L2", "#9a9a9a", "D"),
}
"""The errors of the truth itself: name, colour and marker."""
SMOOTH = 3
"""Order of quadratic elements where nothing is singular."""


@style.figure("truth", tables=("truth",))
def draw_truth(truth) -> Figure:
    """Draw the truth's own errors of each scene, and its order of convergence beside them; a row per scene.

    Points are means over the samples; lines reach to the worst sample, and over the orders of all samples. Crosses are
    those which only choose settings. Where another element was tried, its distance is joined to the truth's own error
    on the same samples. Triangles are what the body's facets change, where its smooth surface is known.
    """
    names = tables.scenes(truth)
    figure, ((left, right),) = style.panels(1, 2, (9.5, 1.5 + 0.36 * len(names)), sharey=True, width_ratios=[3, 2])
    rows = np.arange(len(names))
    for i, (column, (name, colour, marker)) in enumerate(COLUMNS.items()):
        heights = rows + 0.16 * (i - 1)
        largest = truth.get(f"{column}_max", truth[column])
        left.hlines(heights, 100 * truth[column], 100 * largest, color=colour, lw=1.2, alpha=0.5, zorder=2)
        left.plot(100 * truth[column], heights, marker, color=colour, mec="white", mew=0.5, ms=6, label=name, zorder=3)
    _less_known(left, truth, rows)
    _other_element(left, truth, rows)
    _facets(left, truth, rows)
    left.axvline(100 * KNOWN, color="#aa0000", lw=1, ls=(0, (4, 2)), zorder=1)
    left.set(xscale="log", xlabel="error of the truth itself [%]", title="how well the truth is known")
    left.set_yticks(rows, [spaced(scene) for scene in names])
    left.set_ylim(len(names) - 0.5, -0.5)
    low, high = left.get_xlim()
    left.set_xlim(low, max(high, 130 * KNOWN))
    style.plain_log(left.xaxis)
    right.axvline(SMOOTH, color="#aaaaaa", lw=1, ls=":", zorder=0)
    if {"ratio_min", "ratio_max"} <= set(truth):
        orders = [np.log2(truth[name]) for name in ("ratio_min", "ratio_max")]
        right.hlines(rows, *orders, color=style.INK, lw=2.5, alpha=0.3, zorder=1)
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
        looks = {"marker": "x", "ms": 5, "color": colour, "label": "" if i else name}
        _known(axis, truth, f"validation_{column}", rows + 0.16 * (i - 1), **looks)


def _other_element(axis, truth, rows: np.ndarray) -> None:
    """Draw how far the limit of linear elements is, with a line from the truth's own error on the same samples."""
    name = "distance of the limit of linear elements, from the own error of the same samples"
    for offset, ending, colour in ((-0.28, "", "#0072b2"), (0.28, "_patch", "#d55e00")):
        looks = {"color": colour, "label": "" if ending else name}
        distance = _known(axis, truth, f"other_element{ending}", rows + offset, marker="o", mfc="none", ms=5, **looks)
        if distance is not None and f"other_element_own{ending}" in truth:
            own_error = 100 * truth[f"other_element_own{ending}"]
            axis.hlines(rows + offset, own_error, distance, color=colour, lw=0.8, zorder=2)
            axis.plot(own_error, rows + offset, "|", color=colour, ms=6, zorder=3)


def _facets(axis, truth, rows: np.ndarray) -> None:
    """Draw how far the answers of a body of facets and of one on the smooth surface are apart."""
    for offset, column, colour in ((-0.16, "geometry_of_peak", "#0072b2"), (0.0, "geometry_patch_of_peak", "#d55e00")):
        looks = {"color": colour, "label": "" if offset == 0.0 else "what facets change, beside the smooth shape"}
        _known(axis, truth, column, rows + offset, marker="^", mfc="none", ms=6, **looks)


def _known(axis, truth, column: str, places: np.ndarray, **looks):
    """Draw the shares of a column in per cent, and return them; None if no scene has one."""
    if column not in truth or truth[column].isna().all():
        return None
    axis.plot(100 * truth[column], places, ls="", zorder=3, **looks)
    return 100 * truth[column]


SOURCES = {
    "constant": "nothing: the same for all",
    "linear": "the peak of the linear response",
    "turned": "the rotations of the linear response",
    "distance": "the distance to what was learnt from",
    "residual": "one fine residual",
    "coarser": "a second answer, of coarser elements",
    "own": "the model itself",
}
"""The estimates by what they are made from, in words."""
DEAR = ("residual", "coarser")
"""Those that cost a simulation, or a part of one; the others take next to nothing."""
_HUES = ("#9a9a9a", "#e6b400", "#009e73", "#56b4e9", "#d55e00", "#0072b2", "#7a3b63")
_COLOURS = dict(zip(SOURCES, _HUES, strict=True))
_JITTER = 0.18
"""Half width over which the points of one estimate are spread."""


@style.figure("error_bounds", tables=("error_bounds",))
def draw_error_bounds(error_bounds) -> Figure:
    """Draw bound over error against the rank correlation, and the shares of answers below their bounds.

    Errors are those over the surface; a point a setting and scene.
    """
    bounds = tables.where(error_bounds, error="rms")
    figure, ((left, right),) = style.panels(1, 2, (9.5, 4.4), width_ratios=[3, 2.4])
    names = [name for name in SOURCES if name in set(bounds["estimate"])]
    for number, name in enumerate(names):
        rows, colour = tables.where(bounds, estimate=name).dropna(subset="sharpness"), _COLOURS[name]
        points = {"ms": 4, "mec": colour, "alpha": 0.6, "ls": "", "marker": "o"}
        ranks = rows["rank_correlation"].fillna(0.0)
        left.plot(ranks, rows["sharpness"], mfc=colour, **points)
        spread = number + np.linspace(-_JITTER, _JITTER, max(len(rows), 2))[: len(rows)]
        right.plot(spread - 0.2, 100 * rows["coverage"], mfc=colour, **points)
        right.plot(spread + 0.25, 100 * rows["coverage_elsewhere"], mfc="none", **points)
    left.axhline(1, color=style.FAINT, lw=1, ls=":")
    left.set(yscale="log", xlabel="rank correlation of estimate and error", ylabel="bound over error, median")
    left.set(title="how sharp the bounds are")
    style.plain_log(left.yaxis)
    right.axhline(100 * LEVEL, color="#aa0000", lw=1, ls=(0, (4, 2)))
    right.set_xticks(range(len(names)), names)
    right.set(ylabel="answers below their bound [%]", ylim=(0, 103), title="how often they hold")
    right.grid(axis="x", visible=False)
    kinds = [Line2D([], [], ls="", marker="o", color=_COLOURS[name], label=SOURCES[name]) for name in names]
    kinds += [
        Line2D([], [], ls="", marker="o", color=style.INK, label="bound found on this body"),
        Line2D([], [], ls="", marker="o", mfc="none", color=style.INK, label="bound found on the other bodies"),
    ]
    figure.legend(handles=kinds, loc="outside lower center", ncols=3)
    return figure


@style.figure("limit_points", tables=("limit_points",))
def draw_limit_points(limit_points) -> Figure:
    """Draw the peak displacement over the peak pressure of each contact; a panel per body.

    The colour is the least determinant of the deformation gradient; at 0 an element turns inside out. Steps in which
    the dent grows clearly faster than the load are drawn thick; loads without an equilibrium are crosses.
    """
    names = tables.bodies(limit_points)
    figure, (axes,) = style.panels(1, len(names), (4.6 * len(names), 4.4))
    norm, cmap = Normalize(0, 1), "viridis"
    for axis, body in zip(axes, names, strict=True):
        for _, rows in tables.where(limit_points, body=body).groupby("contact", sort=False):
            _contact(axis, rows.sort_values("pressure_of_young"), norm, cmap)
        axis.axvline(PRESSURE, color="#555555", ls=":", lw=1)
        axis.set(title=spaced(body), xlabel="peak pressure [of Young's modulus]")
    axes[0].set_ylabel("peak displacement [% of the body's size]")
    figure.colorbar(ScalarMappable(norm, cmap), ax=axes, label="least determinant of the deformation gradient")
    most = f"the trade-off presses at most {PRESSURE:g}, unless a regime says otherwise"
    handles = [
        Line2D([], [], color="#aa0000", lw=2.5, label="snap: the dent grows much faster than the load"),
        Line2D([], [], ls="", marker="x", color="#aa0000", label="no equilibrium found"),
        Line2D([], [], color="#555555", ls=":", lw=1, label=most),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=1)
    return figure


def _contact(axis, rows, norm, cmap) -> None:
    """Draw one contact: a line, its snaps, its points, and crosses where there is no equilibrium."""
    converged = rows[rows["converged"].astype(bool)]
    pressure, peak = converged["pressure_of_young"].to_numpy(), 100 * converged["peak_of_size"].to_numpy()
    axis.plot(pressure, peak, color="#bbbbbb", lw=1, zorder=1)
    for snap in jumps(converged).itertuples():
        pressures = [snap.pressure_of_young_before, snap.pressure_of_young_after]
        peaks = [100 * snap.peak_of_size_before, 100 * snap.peak_of_size_after]
        axis.plot(pressures, peaks, color="#aa0000", lw=2.5, zorder=2)
    axis.scatter(
        pressure, peak, c=converged["least_det"], norm=norm, cmap=cmap, s=22, edgecolors="white", lw=0.4, zorder=3
    )
    unsolved = rows[~rows["converged"].astype(bool)]
    top = peak[-1] if len(peak) else 0.0
    axis.plot(unsolved["pressure_of_young"], [top] * len(unsolved), "x", color="#aa0000", ms=6, zorder=4)
