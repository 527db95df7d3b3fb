"""One organ out of a CT by its range of grey values."""

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.border import at_half_level
from palpate.bodies.ct.image import Image
from palpate.errors import InputError

# half the width of the bridges to neighbours that are cut, and of the clefts that are closed
OPEN_M, CLOSE_M = 5e-3, 2e-3
# grey values beyond these say no more of an organ, and a clip or a pocket of air must not blur far into it
CLIP_HU = 200


def segment(image: Image, settings: dict) -> np.ndarray:
    """The largest piece in the range ``settings["threshold_hu"]`` [HU], (nz, ny, nx) bool; InputError if none.

    Noise, which is a voxel wide, is blurred by one voxel of the finest spacing; an opening cuts bridges to
    neighbours, a closing smooths the outline and hollows are filled, all in metres, so that slices ten times as
    thick as the pixels are no other case. Then the border goes to the half level (ct_border.py). The order is the
    trap: the largest piece is chosen while the bridges are cut.
    """
    low, high = settings["threshold_hu"]
    soft = np.clip(image.hu, low - CLIP_HU, high + CLIP_HU).astype(np.float32)
    blur = image.spacing_m.min() / image.spacing_m[::-1]
    soft = ndimage.gaussian_filter(soft, blur)
    within = (soft >= low) & (soft <= high)
    if not within.any():
        raise InputError(
            f"{image.source}: no voxel lies between {low:g} and {high:g} HU once noise is blurred by a voxel (before, "
            f"they are {image.hu.min() + 0.0:g} to {image.hu.max() + 0.0:g}); widen threshold_hu or give a mask."
        )
    spacing = image.spacing_m[::-1]
    core = _largest(ndimage.distance_transform_edt(within, spacing) > OPEN_M)
    if not core.any():
        raise InputError(
            f"{image.source}: nothing between {low:g} and {high:g} HU is thicker than {2e3 * OPEN_M:g} mm; "
            "change threshold_hu or give a mask."
        )
    box, margin = _box(core, OPEN_M + 2 * CLOSE_M, spacing)
    core, within = (np.pad(values[box], margin) for values in (core, within))
    organ = within & _grown(core, OPEN_M, spacing)
    organ = ndimage.distance_transform_edt(_grown(organ, CLOSE_M, spacing), spacing) > CLOSE_M
    organ = whole(organ)
    organ = organ[tuple(slice(m, n - m) for m, n in zip(margin[:, 0], organ.shape, strict=True))]
    mask = np.zeros(image.hu.shape, dtype=bool)
    blurred = ndimage.gaussian_filter(image.hu[box].astype(np.float32), blur)
    # twice, as the places well outside are taken from the border that is to be found
    for _ in range(2):
        organ = whole(at_half_level(organ, blurred, spacing, (low, high)))
    mask[box] = organ
    return mask


def whole(mask: np.ndarray) -> np.ndarray:
    """The largest piece of a mask, (nz, ny, nx), with its hollows filled."""
    return ndimage.binary_fill_holes(_largest(mask))


def on_border(mask: np.ndarray) -> bool:
    """Whether voxels of the mask, (nz, ny, nx), lie on the image's border, where the organ is probably cut."""
    return any(mask.take(end, axis).any() for axis in range(3) for end in (0, -1))


def _grown(mask: np.ndarray, radius_m: float, spacing: np.ndarray) -> np.ndarray:
    return ndimage.distance_transform_edt(~mask, spacing) <= radius_m


def _largest(mask: np.ndarray) -> np.ndarray:
    """Its largest piece, connected by faces; all of it if that is nothing."""
    label, count = ndimage.label(mask)
    if count < 2:
        return mask
    return label == 1 + np.argmax(np.bincount(label.ravel())[1:])


def _box(mask: np.ndarray, reach_m: float, spacing: np.ndarray) -> tuple[tuple[slice, ...], np.ndarray]:
    """Where the mask is, with all that is within reach, and the layers (3, 2) to add so that nothing meets an end."""
    layers = np.ceil(reach_m / spacing).astype(int) + 1
    found = ndimage.find_objects(mask.astype(np.uint8))[0]
    box = tuple(
        slice(max(side.start - n, 0), min(side.stop + n, size))
        for side, n, size in zip(found, layers, mask.shape, strict=True)
    )
    return box, np.column_stack([layers, layers])
