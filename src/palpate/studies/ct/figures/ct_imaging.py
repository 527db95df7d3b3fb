"""Steps from a scan to a picture and a mask: ray casting, an MRI, and masks drawn on every n-th slice (paper 3)."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.bodies.ct.image import Image
from palpate.report import style, tables
from palpate.studies.ct.imaging import BETWEEN, Pictures

_INCHES = 10.5
_FOUND, _TRUE = "#d55e00", "#009e73"
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00")


@style.styled
def draw(shown: Pictures, mask_interpolation: pd.DataFrame) -> Figure:
    """Draw pictures of the synthetic abdomen by ray casting, its MRI with what is found, and interpolated masks.

    mask_interpolation : the table of this name
    """
    ray_cast = shown.taken.shape[0] / shown.taken.shape[1]
    figure = Figure(figsize=(_INCHES, _INCHES / 4 * (ray_cast + 0.75) + 0.9), layout="constrained")
    axes = figure.subplots(2, 4, height_ratios=(ray_cast, 0.75))
    for axis, (caption, picture) in zip(axes[0], shown.cast.items(), strict=False):
        _picture(axis, caption).imshow(np.clip(picture, 0, 1), interpolation="none")
    taken = _picture(axes[0, 3], "samples taken of each ray")
    bar = taken.imshow(shown.taken, cmap="YlGnBu", vmin=0, vmax=1, interpolation="none")
    figure.colorbar(bar, ax=taken, orientation="horizontal", shrink=0.7, pad=0.02, label="share of the samples")
    for axis, (image, found), caption in zip(axes[1], shown.mris, ("MRI as it is", "MRI, evened"), strict=False):
        _mri(_picture(axis, caption), image, found, shown.liver)
    gap = axes[1, 2].get_subplotspec()
    for axis in axes[1, 2:]:
        axis.remove()
    _masks(figure.add_subplot(gap.get_gridspec()[1, 2:]), mask_interpolation)
    return figure


def _picture(axis: Axes, caption: str) -> Axes:
    axis.set(title=caption, xticks=[], yticks=[])
    axis.grid(False)
    axis.spines[:].set_visible(False)
    return axis


def _mri(axis: Axes, image: Image, found: np.ndarray, liver: np.ndarray) -> None:
    """Draw the axial slice in the middle of the true liver, with the outlines of what is found and of the truth."""
    at = int(liver.sum(axis=(1, 2)).argmax())
    steps = image.spacing_m[1] / image.spacing_m[0]
    axis.imshow(image.hu[at], cmap="gray", vmin=0, vmax=np.percentile(image.hu, 99), aspect=steps)
    for mask, colour, line in ((liver, _TRUE, "--"), (found, _FOUND, "-")):
        if mask[at].any():
            axis.contour(mask[at].astype(float), [0.5], colors=colour, linewidths=1.1, linestyles=line)
    axis.plot([], [], color=_TRUE, ls="--", label="truth")
    axis.plot([], [], color=_FOUND, label="found")
    # on black of its own: the body is bright
    axis.legend(
        loc="lower right", labelcolor="white", frameon=True, facecolor="black", framealpha=1.0, edgecolor="none"
    )


def _masks(axis: Axes, table: pd.DataFrame) -> None:
    """Draw how far masks come back over how many slices apart they are drawn."""
    for i, body in enumerate(tables.bodies(table)):
        for method, line in ((BETWEEN, "-"), (None, ":")):
            rows = tables.where(table, body=body)
            rows = rows[(rows["method"] == BETWEEN) == (method == BETWEEN)].sort_values("every")
            label = body if method else None
            axis.plot(
                rows["every"], rows["dice"], line, color=_COLOURS[i % len(_COLOURS)], marker="o", ms=3, label=label
            )
    axis.axhline(0.95, color=style.FAINT, lw=0.8)
    axis.plot([], [], ":", color=style.INK, label="nearest drawn slice")
    axis.set(title="masks from every n-th slice", xlabel="n", ylabel="Dice against the whole mask")
    axis.set_ylim(top=1.005)
    axis.legend(loc="lower left")
