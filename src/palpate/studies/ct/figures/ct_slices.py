"""Three orthogonal slices through an organ in its CT or MRI, with the outline of the segmentation."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.ct.image import Image
from palpate.report import style

_WINDOW = (-160, 240)  # [HU], the usual window for the abdomen
_OUTLINE = "#ffb000"
_INCHES = 10.5

# name, normal axis of the array, and the array axes that point right and up in the picture
_SLICES = (("axial", 0, 2, 1), ("coronal", 1, 2, 0), ("sagittal", 2, 1, 0))
_ENDS = {2: ("right", "left"), 1: ("front", "back"), 0: ("feet", "head")}


@style.styled
def draw(image: Image, mask: np.ndarray, name: str) -> Figure:
    """Draw slices through the middle of the organ ``mask``, (nz, ny, nx) bool, of the body ``name``, to one scale.

    Radiological convention: the patient's right is on the left, the front is at the top of the axial slice.
    """
    size = 1e3 * np.array(image.hu.shape) * image.spacing_m[::-1]
    across = [size[a] for _, _, a, _ in _SLICES]
    tallest = max(size[u] for _, _, _, u in _SLICES)
    figure = Figure(figsize=(_INCHES, _INCHES * tallest / sum(across) + 0.4), layout="constrained")
    axes = figure.subplots(1, 3, width_ratios=across)
    for axis, (plane, cut, right, up) in zip(axes, _SLICES, strict=True):
        at = _richest(mask, cut)
        axis.set_title(f"{plane}, {1e3 * image.to_world(np.eye(3)[cut] * at)[2 - cut]:.0f} mm")
        _slice(axis, image, mask, (cut, at), (right, up))
    figure.suptitle(name, x=0.01, ha="left", fontsize=9, fontweight="bold")
    return figure


def _richest(mask, cut: int) -> int:
    """Find the index along an axis at which the organ's cross-section is largest."""
    return int(mask.sum(axis=tuple(axis for axis in range(3) if axis != cut)).argmax())


def _window(image: Image) -> tuple[float, float]:
    """Return the grey values that are drawn black and white: usual ones of a CT, and the range of an MRI."""
    return _WINDOW if image.modality == "ct" else (float(image.hu.min()), float(np.percentile(image.hu, 99)))


def _slice(axis, image, mask, cut: tuple[int, int], shown: tuple[int, int]) -> None:
    """Draw one slice with axes in mm; ``cut`` is its normal axis and index, ``shown`` the axes to the right and up."""
    right, up = shown
    grey, inside = np.take(image.hu, cut[1], axis=cut[0]), np.take(mask, cut[1], axis=cut[0])
    low = 1e3 * (image.to_world(np.full(3, -0.5)))
    high = 1e3 * image.to_world(np.array(image.hu.shape) - 0.5)
    extent = (low[2 - right], high[2 - right], low[2 - up], high[2 - up])
    darkest, brightest = _window(image)
    axis.imshow(grey, cmap="gray", vmin=darkest, vmax=brightest, extent=extent, origin="lower", aspect="equal")
    places = [1e3 * (image.origin_m[2 - a] + image.spacing_m[2 - a] * np.arange(image.hu.shape[a])) for a in shown]
    if inside.any():
        axis.contour(*places, inside.astype(float), [0.5], colors=_OUTLINE, linewidths=1.1)
    if up == 1:
        axis.invert_yaxis()
    axis.grid(False)
    axis.set_xlabel("{} – {} [mm]".format(*_ENDS[right]))
    axis.set_ylabel("{} – {} [mm]".format(*(_ENDS[up][::-1] if up == 1 else _ENDS[up])))
