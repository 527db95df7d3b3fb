"""Time of a step over particles, clusters and modes (paper 3's figure 3.12)."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline

TABLES = ("shape_matching_timing",)
_MODES = {"rigid": ("#0072b2", "o", 7), "linear": ("#009e73", "s", 4), "quadratic": ("#d55e00", "D", 4)}
"""Colour, marker and its size; rigid and linear cost the same, so that one marker must surround the other."""

_THESIS_MS, _NS = 20.0, 20.0


@style.styled
def draw(shape_matching_timing) -> Figure:
    """Draw objects of 100 particles, one panel for each number of clusters, and one object of many particles.

    Exponents are fitted from FEWEST particles on, below which the cost of calling compiled functions matters.

    shape_matching_timing : the table of this name
    """
    table = shape_matching_timing
    many, one = table[table["particles"] == 100], table[table["objects"] == 1]
    counts = sorted(many["clusters"].unique())
    figure = Figure(figsize=(2.6 * (len(counts) + 1) + 0.4, 3.9), layout="constrained")
    axes = figure.subplots(1, len(counts) + 1, sharey=True)
    slopes = exponents(table).set_index(["mode", "clusters"])["exponent"]
    for axis, clusters in zip(axes, counts, strict=False):
        title = f"objects of 100 particles,\n{clusters} cluster{'s' if clusters > 1 else ''} each"
        fits = slopes.xs(clusters, level="clusters")
        _curves(axis, many[many["clusters"] == clusters], title, {m: f"{m}: n$^{{{fits[m]:.2f}}}$" for m in fits.index})
        if clusters == HEADLINE["clusters"]:
            _mark_headline(axis, headline(table))
    largest = one[one["clusters"] == HEADLINE["clusters"]]
    _curves(axes[-1], largest, f"one object,\n{HEADLINE['clusters']} clusters", {m: m for m in _MODES})
    axes[0].set_ylabel("time of a step on one core [ms]")
    axes[0].set_ylim(table["ms_per_step"].min() / 12, 60)
    for axis in axes:
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
    return figure


def _curves(axis, rows, title: str, labels: dict[str, str]) -> None:
    for mode, label in labels.items():
        colour, marker, size = _MODES[mode]
        curve = rows[rows["mode"] == mode].sort_values("all_particles")
        axis.loglog(curve["all_particles"], curve["ms_per_step"], color=colour, marker=marker, ms=size, label=label)
    ends = np.array([rows["all_particles"].min(), rows["all_particles"].max()])
    axis.loglog(ends, 1e-6 * _NS * ends, color=style.FAINT, lw=0.8, ls=":", label=f"{_NS:g} ns per particle")
    axis.set(title=title, xlabel="total number of particles, n")
    axis.legend(loc="lower right")


def _mark_headline(axis, milliseconds: float) -> None:
    """Mark the thesis' time for 100 quadratic objects, and this machine's."""
    particles = HEADLINE["objects"] * HEADLINE["particles"]
    axis.plot(particles, _THESIS_MS, "*", color=style.INK, ms=9)
    axis.annotate(
        f"thesis: {_THESIS_MS:g} ms\nhere: {milliseconds:.2g} ms",
        (particles, _THESIS_MS),
        xytext=(-8, 0),
        textcoords="offset points",
        ha="right",
        va="center",
        fontsize=8,
    )
    axis.plot([particles] * 2, [milliseconds, _THESIS_MS], color=style.INK, lw=0.8, ls="--")
