"""Draw what was identified from presses: measured and predicted forces, and profiles of the likelihood."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.identification.identify import MODULUS, OFFSET, YOUNG, Identified
from palpate.report import style
from palpate.report.turnable import evenly
from palpate.report.words import spaced

MOST_CURVES = 12
"""Presses that are drawn, spread over the strength of their forces."""
HIGHEST = 4.0
"""Of a profile's axis, over the threshold."""
AXES = {YOUNG: ("E [kPa]", 1e-3), MODULUS: ("E/(1 − ν²) [kPa]", 1e-3), "poisson": ("ν", 1.0),
        "thickness_m": ("thickness [mm]", 1e3), "stiffening": ("stiffening of the law", 1.0),
        "sticking": ("friction: 0 slides, 1 sticks", 1.0), OFFSET: ("first touch [mm]", 1e3)}  # fmt: skip
MEASURED, PREDICTED = "#0072b2", "#d55e00"


@style.styled
def draw_identified(identified: Identified) -> Figure:
    """Draw forces over depth, measured and fitted, and each profile with its threshold and the interval told."""
    names = [name for name in AXES if name in identified.profiles]
    columns = 3
    lines = 1 + -(-len(names) // columns)
    figure = Figure(figsize=(10.0, 3.6 + 2.3 * (lines - 1)), layout="constrained")
    grid = figure.add_gridspec(lines, columns, height_ratios=[1.5, *[1.0] * (lines - 1)])
    _curves(figure.add_subplot(grid[0, :2]), identified)
    _agreement(figure.add_subplot(grid[0, 2]), identified)
    for number, name in enumerate(names):
        _profile(figure.add_subplot(grid[1 + number // columns, number % columns]), identified, name)
    return figure


def _curves(axis: Axes, identified: Identified) -> None:
    largest_n = np.array([np.abs(curve.force_n).max() for curve in identified.curves])
    chosen = np.argsort(largest_n)[evenly(len(largest_n), MOST_CURVES)]
    for number, k in enumerate(chosen):
        curve = identified.curves[k]
        axis.plot(1e3 * curve.depth_m, curve.force_n, "o", ms=3, color=MEASURED, label="" if number else "measured")
        label = "" if number else f"{spaced(identified.law)}, with its place's effects"
        axis.plot(1e3 * curve.depth_m, curve.predicted_n, lw=1.0, color=PREDICTED, label=label)
    axis.set(xlabel="depth [mm]", ylabel="force [N]", title=f"{len(chosen)} of {len(largest_n)} presses")
    axis.legend(loc="upper left")


def _agreement(axis: Axes, identified: Identified) -> None:
    parts_of_curves = [
        (curve.depth_m / curve.depth_m.max(), curve.force_n / curve.predicted_n - 1.0) for curve in identified.curves
    ]
    depth, residual = (np.concatenate(parts) for parts in zip(*parts_of_curves, strict=True))
    axis.plot(depth, 100.0 * residual, ".", ms=2, color=style.FAINT)
    edges = np.linspace(0.0, 1.0, 9)
    medians = [np.median(residual[(depth > a) & (depth <= b)]) if ((depth > a) & (depth <= b)).any() else np.nan
              for a, b in pairwise(edges)]  # fmt: skip
    axis.plot(0.5 * (edges[:-1] + edges[1:]), 100.0 * np.array(medians), "o-", ms=4, color=style.INK, label="median")
    span = 100.0 * float(np.quantile(np.abs(residual), 0.95))
    axis.set(xlabel="depth over the largest", ylabel="measured over fitted, less 1 [%]", title="what is left")
    axis.set_ylim(-span, span)
    axis.legend(loc="upper right")


def _profile(axis: Axes, identified: Identified, name: str) -> None:
    label, factor = AXES[name]
    profile = identified.profiles[name]
    axis.plot(factor * profile.values, profile.minus2, "o-", ms=3, color=style.INK)
    axis.axhline(identified.rise, color=PREDICTED, lw=1.0)
    interval = identified.intervals[name]
    axis.axvspan(factor * interval.low, factor * interval.high, color=PREDICTED, alpha=0.12, lw=0)
    axis.set(xlabel=label, ylabel="−2 log likelihood", ylim=(-0.05 * identified.rise, HIGHEST * identified.rise))
    if name in identified.parameters and not interval.known:
        axis.set_title("not determined")
