"""Difference that a ball makes to a press on a slab, by its contrast and depth, and the least contrast that is felt."""

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from palpate.report import style
from palpate.studies.palpation.palpation_limits import least_contrasts

TABLES = ("palpation_limits",)


@style.styled
def draw(palpation_limits) -> Figure:
    """Draw the difference over the contrast, a line for each depth, and the least contrast felt over the depth.

    palpation_limits : the table of this name
    """
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    covers = sorted(palpation_limits["cover_m"].unique())
    for cover, share in zip(covers, np.linspace(0.0, 0.9, len(covers)), strict=True):
        rows = palpation_limits[palpation_limits["cover_m"] == cover].sort_values("contrast")
        colour = colormaps["viridis"](share)
        left.plot(rows["contrast"], 100 * rows["stiffer"], color=colour, marker="o", ms=4, label=f"{1e3 * cover:g} mm")
    edge = 100 * palpation_limits["threshold"].iloc[0]
    left.axhline(edge, color="#aa0000", ls=":", lw=1, label="felt above")
    left.set(title="what the finger feels", xlabel="stiffness of the ball over the slab's", ylabel="stiffer by [%]")
    left.set_xscale("log")
    left.legend(title="depth of the ball's top", loc="upper left", ncols=2)
    left.set_ylim(0.0, 140 * palpation_limits["stiffer"].max())
    found = least_contrasts(palpation_limits)
    known = {cover: contrast for cover, contrast in found.items() if np.isfinite(contrast)}
    right.plot([1e3 * cover for cover in known], list(known.values()), color=style.INK, marker="o", ms=4)
    for cover in set(found) - set(known):
        right.axvline(1e3 * cover, color="#aa0000", ls="--", lw=1)
        right.annotate("never felt", (1e3 * cover, 0.95), (-3, 0), ("data", "axes fraction"), "offset points",
                       ha="right", va="top", rotation=90, color="#aa0000")  # fmt: skip
    right.set(
        title="least contrast that is felt", xlabel="depth of the ball's top [mm]", ylabel="stiffness over the slab's"
    )
    right.set_yscale("log")
    right.set_ylim(1.0, None)
    style.plain_log(right.yaxis)
    return figure
