"""Places where the image ends inside an organ."""

from collections.abc import Sequence

import numpy as np

from palpate.bodies.ct.image import AIR_HU, Image

_SIDES = (("feet", "head"), ("front", "back"), ("right", "left"))
"""Of the patient, at the first and the last index along z, y and x."""
LEAST_M2 = 1e-4
"""Area of contact with padding from which on it counts: single voxels of air may touch an organ."""


def cut_off(image: Image, mask: np.ndarray, whole: Sequence[int], start: Sequence[int]) -> list[str]:
    """Describe where an organ ``mask``, (nz, ny, nx) bool, is cut off, with each cut's area; no item if it is whole.

    whole, start : voxels of the image before it was cropped, and index of the first one that was kept, z y x
    Besides the borders of the image there is the padding around the circle that a scanner sees.
    """
    return [*_at_borders(image, mask, whole, start), *_at_padding(image, mask)]


def _at_borders(image: Image, mask: np.ndarray, whole: Sequence[int], start: Sequence[int]) -> list[str]:
    found = []
    for axis, sides in enumerate(_SIDES):
        for end, side in zip((0, -1), sides, strict=True):
            area = float(mask.take(end, axis).sum() * _face_m2(image, axis))
            cropped = start[axis] > 0 if end == 0 else start[axis] + mask.shape[axis] < whole[axis]
            if area:
                found.append(f"{'crop_m' if cropped else 'the image'} towards the {side} ({_cm2(area)})")
    return found


def _at_padding(image: Image, mask: np.ndarray) -> list[str]:
    if image.modality != "ct":
        return []
    area, padding = 0.0, image.hu <= AIR_HU
    for axis in range(3):
        organ, empty = np.moveaxis(mask, axis, 0), np.moveaxis(padding, axis, 0)
        touching = (organ[1:] & empty[:-1]).sum() + (organ[:-1] & empty[1:]).sum()
        area += float(touching * _face_m2(image, axis))
    return [f"the padding around the scanned circle ({_cm2(area)})"] if area >= LEAST_M2 else []


def _cm2(area_m2: float) -> str:
    return f"{1e4 * area_m2:.0f} cm²" if area_m2 >= 1e-3 else f"{1e4 * area_m2:.2g} cm²"


def _face_m2(image: Image, axis: int) -> float:
    """Return the area [m²] of a voxel's face across an axis of the array."""
    return image.voxel_m3 / float(image.spacing_m[2 - axis])
