"""Interpolation of a mask that was drawn on some slices only."""

from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.interpolate import Akima1DInterpolator

from palpate.bodies.ct.image import Image
from palpate.errors import InputError


def fill_between(mask: np.ndarray, image: Image, axis: str, path: Path) -> np.ndarray:
    """Fill a mask, (nz, ny, nx) bool, between the slices that were drawn across ``axis`` ("x", "y" or "z").

    Shape-based interpolation (Raya, Udupa, IEEE Trans. Med. Imaging 9(1), 1990): the signed distance to the outline of
    each drawn slice is interpolated across the slices between them, and is positive inside. In each voxel Akima's
    curve passes through the distances, as straight lines would flatten a round organ (Herman, Zheng, Bucholtz, IEEE
    CG&A 12(3), 1992, with other curves). The slice that would have been drawn next is empty: the organ's thickest
    place has just vanished there, so that it ends before. Drawn slices stay as they are.
    Raises InputError if fewer than two slices were drawn; ``path`` is the mask's in the message.
    """
    along = 2 - "xyz".index(axis)
    slices = np.moveaxis(mask, along, 0)
    drawn = np.flatnonzero(slices.any(axis=(1, 2)))
    if len(drawn) < 2:
        raise InputError(
            f"{path}: the mask has {len(drawn)} slice(s) across {axis}, and drawn_slices needs two at least; "
            "draw more, or leave drawn_slices out."
        )
    steps = np.delete(image.spacing_m[::-1], along)
    box = _box_around(slices)
    known = np.array([_signed_distance(slices[at][box], steps) for at in drawn])
    places = np.array([2 * drawn[0] - drawn[1], *drawn, 2 * drawn[-1] - drawn[-2]])
    first, last = (known[end] - known[end].max() for end in (0, -1))
    curve = Akima1DInterpolator(places, np.stack([first, *known, last]), axis=0)
    filled = slices.copy()
    for at in range(max(places[0] + 1, 0), min(places[-1], len(slices))):
        if at not in drawn:
            filled[at][box] = curve(at) > 0
    return np.moveaxis(filled, 0, along)


def undrawn_across(mask: np.ndarray) -> str | None:
    """Return the axis across which no slice of a mask has a neighbour, as if every n-th was drawn; None if none is."""
    for axis, along in zip("zyx", range(3), strict=True):
        found = np.asarray(mask.any(axis=tuple(other for other in range(3) if other != along)))
        if found.sum() > 1 and not (found[1:] & found[:-1]).any():
            return axis
    return None


def _box_around(slices: np.ndarray) -> tuple[slice, slice]:
    """Find the part of the slices that has any voxel, one voxel wider where there is room."""
    found = ndimage.find_objects(slices.any(axis=0).astype(np.uint8))[0]
    first, second = (slice(max(side.start - 1, 0), side.stop + 1) for side in found)
    return first, second


def _signed_distance(drawn: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the distance [m] to the outline of a slice, (n, m): positive inside."""
    return ndimage.distance_transform_edt(drawn, steps) - ndimage.distance_transform_edt(~drawn, steps)
