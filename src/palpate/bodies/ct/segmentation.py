"""Segmentation of one organ from a CT by its range of grey values."""

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.border import move_to_half_level
from palpate.bodies.ct.image import Image
from palpate.errors import InputError

# radii of the opening, which cuts bridges to neighbours, and of the closing, which closes clefts
OPEN_M, CLOSE_M = 5e-3, 2e-3
# grey values are clipped this far beyond the range, so that metal or a pocket of air does not blur far into the organ
CLIP_HU = 200


def segment(image: Image, settings: dict) -> np.ndarray:
    """Segment the largest piece in the range ``settings["threshold_hu"]`` [HU], (nz, ny, nx) bool; InputError if none.

    Noise, a voxel wide, is blurred by one voxel of the finest spacing; an opening cuts bridges to neighbours, a
    closing smooths the outline, and cavities are filled; all lengths are in metres, so that slices may be ten times as
    thick as the pixels. Then the border moves to the half level (border.py). Trap: the order matters; the largest
    piece is chosen while the bridges are cut.
    """
    low, high = settings["threshold_hu"]
    smooth = np.clip(image.hu, low - CLIP_HU, high + CLIP_HU).astype(np.float32)
    blur = image.spacing_m.min() / image.spacing_m[::-1]
    smooth = ndimage.gaussian_filter(smooth, blur)
    within = (smooth >= low) & (smooth <= high)
    if not within.any():
        raise InputError(
            f"{image.source}: no voxel lies between {low:g} and {high:g} HU once noise is blurred by a voxel (before, "
            f"they are {image.hu.min() + 0.0:g} to {image.hu.max() + 0.0:g}); widen threshold_hu or give a mask."
        )
    spacing = image.spacing_m[::-1]
    core = _largest_piece(ndimage.distance_transform_edt(within, spacing) > OPEN_M)
    if not core.any():
        raise InputError(
            f"{image.source}: nothing between {low:g} and {high:g} HU is thicker than {2e3 * OPEN_M:g} mm; "
            "change threshold_hu or give a mask."
        )
    box, margin = _box(core, OPEN_M + 2 * CLOSE_M, spacing)
    core, within = (np.pad(values[box], margin) for values in (core, within))
    organ = within & _dilate(core, OPEN_M, spacing)
    organ = ndimage.distance_transform_edt(_dilate(organ, CLOSE_M, spacing), spacing) > CLOSE_M
    organ = largest_filled(organ)
    organ = organ[tuple(slice(m, n - m) for m, n in zip(margin[:, 0], organ.shape, strict=True))]
    mask = np.zeros(image.hu.shape, dtype=bool)
    blurred = ndimage.gaussian_filter(image.hu[box].astype(np.float32), blur)
    # twice, as the voxels well outside depend on the border that is sought
    for _ in range(2):
        organ = largest_filled(move_to_half_level(organ, blurred, spacing, (low, high)))
    mask[box] = organ
    return mask


def largest_filled(mask: np.ndarray) -> np.ndarray:
    """Keep the largest piece of a mask, (nz, ny, nx), with its cavities filled."""
    return ndimage.binary_fill_holes(_largest_piece(mask))


def on_border(mask: np.ndarray) -> bool:
    """Test whether voxels of the mask, (nz, ny, nx), lie on the image's border, which then probably cuts the organ."""
    return any(mask.take(end, axis).any() for axis in range(3) for end in (0, -1))


def _dilate(mask: np.ndarray, radius_m: float, spacing: np.ndarray) -> np.ndarray:
    return ndimage.distance_transform_edt(~mask, spacing) <= radius_m


def _largest_piece(mask: np.ndarray) -> np.ndarray:
    """Keep the largest piece, connected by faces; all of the mask if it is empty."""
    label, count = ndimage.label(mask)
    if count < 2:
        return mask
    return label == 1 + np.argmax(np.bincount(label.ravel())[1:])


def _box(mask: np.ndarray, reach_m: float, spacing: np.ndarray) -> tuple[tuple[slice, ...], np.ndarray]:
    """Find the mask's bounding box with all within reach, and the layers (3, 2) to pad so that no border is reached."""
    layers = np.ceil(reach_m / spacing).astype(int) + 1
    found = ndimage.find_objects(mask.astype(np.uint8))[0]
    box = tuple(
        slice(max(side.start - n, 0), min(side.stop + n, size))
        for side, n, size in zip(found, layers, mask.shape, strict=True)
    )
    return box, np.column_stack([layers, layers])
