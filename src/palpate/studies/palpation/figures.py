"""Figures of palpation: what a finger feels at places of a body, and how deep a ball in a slab may lie."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.words import spaced
from palpate.studies.palpation.palpation import least_contrasts

FELT = "#aa0000"
"""Colour of what separates places that feel different from others."""


@style.figure("palpation", tables=("palpation",))
def draw_palpation(palpation) -> Figure:
    """Draw force over depth of three places, and how much stiffer each is than without regions over its distance.

    A row of panels for each body. Curves are of the two places nearest to a region and of the farthest, by colour.
    """
    names = tables.bodies(palpation)
    figure, axes = style.panels(len(names), 2, (9.5, 3.6 * len(names)))
    for (left, right), body in zip(axes, names, strict=True):
        rows = tables.where(palpation, body=body)
        norm = Normalize(0, max(1e3 * rows["cover_m"].max(), 1.0))
        shown = rows.drop_duplicates("contact").sort_values("cover_m", kind="stable")["contact"].tolist()
        for contact in dict.fromkeys([*shown[:2], shown[-1]]):
            place = rows[rows["contact"] == contact]
            _curve(left, place, colormaps["viridis"](norm(1e3 * place["cover_m"].iloc[0])))
        _shares(right, rows, norm)
        title = spaced(body)
        left.set(title=f"{title}: what the finger feels", xlabel="depth [mm]", ylabel="force [N]")
        right.set(title=f"{title}: where it differs", xlabel="distance from the region [mm]", ylabel="stiffer by [%]")
        colours = [line.get_color() for line in left.lines if line.get_linestyle() == "-"]
        places = zip(colours, ("nearest place", "next place", "farthest place"), strict=False)
        handles = [Line2D([], [], color=colour, label=name) for colour, name in places]
        handles.append(Line2D([], [], color=style.INK, label="with the region"))
        handles.append(Line2D([], [], color=style.INK, ls="--", label="without it"))
        left.legend(handles=handles, loc="lower right")
    return figure


def _curve(axis, place, colour) -> None:
    """Draw the two curves of a place."""
    force = np.concatenate([[0.0], place["force_n"]])
    for column, dashes in (("depth_m", "-"), ("depth_without_m", "--")):
        axis.plot(1e3 * np.concatenate([[0.0], place[column]]), force, color=colour, ls=dashes, lw=1.2)


def _shares(axis, rows, norm) -> None:
    """Draw how much stiffer each place is, under the least force and the largest, and the share that is felt."""
    for force, marker in ((rows["force_n"].min(), "o"), (rows["force_n"].max(), "s")):
        chosen = tables.where(rows, force_n=force)
        cover, stiffer = 1e3 * chosen["cover_m"], 100 * chosen["stiffer"]
        axis.scatter(cover, stiffer, c=cover, norm=norm, cmap="viridis", marker=marker, label=f"{force:.2g} N")
    edge = 100 * rows["threshold"].iloc[0]
    axis.axhline(edge, color=FELT, ls=":", lw=1)
    axis.annotate(
        "felt above", (1.0, edge), (-2, 3), ("axes fraction", "data"), "offset points", ha="right", color=FELT
    )
    axis.set_ylim(top=130 * max(rows["stiffer"].max(), rows["threshold"].iloc[0]))
    axis.legend(loc="upper right")


@style.figure("palpation_limits", tables=("palpation_limits",))
def draw_palpation_limits(palpation_limits) -> Figure:
    """Draw the difference over the contrast, a line for each depth, and the least contrast felt over the depth."""
    figure, ((left, right),) = style.panels(1, 2, (9.5, 3.8))
    covers = sorted(palpation_limits["cover_m"].unique())
    for cover, share in zip(covers, np.linspace(0.0, 0.9, len(covers)), strict=True):
        rows = tables.where(palpation_limits, cover_m=cover).sort_values("contrast")
        colour = colormaps["viridis"](share)
        left.plot(rows["contrast"], 100 * rows["stiffer"], color=colour, marker="o", ms=4, label=f"{1e3 * cover:g} mm")
    edge = 100 * palpation_limits["threshold"].iloc[0]
    left.axhline(edge, color=FELT, ls=":", lw=1, label="felt above")
    left.set(title="what the finger feels", xlabel="stiffness of the ball over the slab's", ylabel="stiffer by [%]")
    left.set_xscale("log")
    left.legend(title="depth of the ball's top", loc="upper left", ncols=2)
    left.set_ylim(0.0, 140 * palpation_limits["stiffer"].max())
    contrasts = least_contrasts(palpation_limits)
    felt = {cover: contrast for cover, contrast in contrasts.items() if np.isfinite(contrast)}
    right.plot([1e3 * cover for cover in felt], list(felt.values()), color=style.INK, marker="o", ms=4)
    for cover in set(contrasts) - set(felt):
        right.axvline(1e3 * cover, color=FELT, ls="--", lw=1)
        right.annotate("never felt", (1e3 * cover, 0.95), (-3, 0), ("data", "axes fraction"), "offset points",
                       ha="right", va="top", rotation=90, color=FELT)  # fmt: skip
    right.set(xlabel="depth of the ball's top [mm]", ylabel="stiffness over the slab's")
    right.set(title="least contrast that is felt", yscale="log", ylim=(1.0, None))
    style.plain_log(right.yaxis)
    return figure
