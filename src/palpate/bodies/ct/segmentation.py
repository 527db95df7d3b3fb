"""Segment an organ by its range of grey values, an MRI's evened first, or fill a mask drawn on some slices only."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.interpolate import Akima1DInterpolator

from palpate.bodies.ct.image import Image
from palpate.errors import InputError


def move_to_half_level(
    organ: np.ndarray, smooth: np.ndarray, spacing: np.ndarray, threshold_hu: Sequence[float]
) -> np.ndarray:
    """Move the border of ``organ`` to where ``smooth`` is midway between inside and outside, both (nz, ny, nx).

    smooth : [HU], the CT blurred by a voxel of the finest spacing; spacing : (3,) [m] along z, y and x
    A fixed lower threshold cuts off border voxels, whose value is between the organ's and that of fat or air beside it.
    So each voxel near the border goes to whichever is nearer in HU: the nearest voxel well inside, or the nearest
    one well outside. Where the latter is within the organ's range ``threshold_hu``, the grey values do not distinguish
    the two, and the border stays.
    """
    # width of the blurred border: one voxel from the scanner's averaging, and twice the deviation of the blur
    steps = spacing / (spacing + 2 * spacing.min())
    well_inside = ndimage.distance_transform_edt(organ, steps) >= 1
    well_outside = ndimage.distance_transform_edt(~organ, steps) >= 1
    if not (well_inside.any() and well_outside.any()):
        return organ
    inside_hu, outside_hu = (
        smooth[tuple(ndimage.distance_transform_edt(~reference, steps, return_distances=False, return_indices=True))]
        for reference in (well_inside, well_outside)
    )
    lowest, highest = threshold_hu
    near_border = ~well_inside & ~well_outside & ((outside_hu < lowest) | (outside_hu > highest))
    return np.where(near_border, np.abs(smooth - inside_hu) < np.abs(smooth - outside_hu), organ)


# radii of the opening, which cuts bridges to neighbours, and of the closing, which closes clefts
OPEN_M, CLOSE_M = 5e-3, 2e-3
# grey values are clipped this far beyond the range, so that metal or a pocket of air does not blur far into the organ;
# those of an MRI, which have no unit, by the width of the range
CLIP_HU = 200


def segment(image: Image, limits: Sequence[float]) -> np.ndarray:
    """Segment the largest piece in a range of grey values, (nz, ny, nx) bool; InputError if there is none.

    limits : lowest and highest grey value, of a CT [HU]

    Noise, a voxel wide, is blurred by one voxel of the finest spacing; an opening cuts bridges to neighbours, a
    closing smooths the outline, and cavities are filled; all lengths are in metres, so that slices may be ten times as
    thick as the pixels. Then the border moves to the half level. Trap: the order matters; the largest
    piece is chosen while the bridges are cut.
    """
    (low, high), (key, unit) = limits, ("threshold_hu", " HU") if image.modality == "ct" else ("threshold", "")
    clip_width = CLIP_HU if unit else high - low
    smooth = np.clip(image.hu, low - clip_width, high + clip_width).astype(np.float32)
    sigma = image.spacing_m.min() / image.spacing_m[::-1]
    smooth = ndimage.gaussian_filter(smooth, sigma)
    in_range = (smooth >= low) & (smooth <= high)
    if not in_range.any():
        raise InputError(
            f"{image.source}: no voxel lies between {low:g} and {high:g}{unit} once noise is blurred by a voxel "
            f"(before, they are {image.hu.min() + 0.0:g} to {image.hu.max() + 0.0:g}); widen {key} or give a mask."
        )
    spacing = image.spacing_m[::-1]
    core = _largest_piece(ndimage.distance_transform_edt(in_range, spacing) > OPEN_M)
    if not core.any():
        raise InputError(
            f"{image.source}: nothing between {low:g} and {high:g}{unit} is thicker than {2e3 * OPEN_M:g} mm; "
            f"change {key} or give a mask."
        )
    # with layers so that neither the opening nor the closing reaches a border
    margin = np.ceil((OPEN_M + 2 * CLOSE_M) / spacing).astype(int) + 1
    box = box_around(core, margin)
    core, in_range = (np.pad(values[box], margin[:, None]) for values in (core, in_range))
    organ = in_range & _dilate(core, OPEN_M, spacing)
    organ = ndimage.distance_transform_edt(_dilate(organ, CLOSE_M, spacing), spacing) > CLOSE_M
    organ = largest_filled(organ)
    organ = organ[tuple(slice(m, n - m) for m, n in zip(margin, organ.shape, strict=True))]
    mask = np.zeros(image.hu.shape, dtype=bool)
    blurred = ndimage.gaussian_filter(image.hu[box].astype(np.float32), sigma)
    # twice, as the voxels well outside depend on the border that is sought
    for _ in range(2):
        organ = largest_filled(move_to_half_level(organ, blurred, spacing, (low, high)))
    mask[box] = organ
    return mask


def largest_filled(mask: np.ndarray) -> np.ndarray:
    """Keep the largest piece of a mask, (nz, ny, nx), with its cavities filled."""
    return ndimage.binary_fill_holes(_largest_piece(mask))


def _dilate(mask: np.ndarray, radius_m: float, spacing: np.ndarray) -> np.ndarray:
    return ndimage.distance_transform_edt(~mask, spacing) <= radius_m


def _largest_piece(mask: np.ndarray) -> np.ndarray:
    """Keep the largest piece, connected by faces; all of the mask if it is empty."""
    label, count = ndimage.label(mask)
    if count < 2:
        return mask
    return label == 1 + np.argmax(np.bincount(label.ravel())[1:])


def box_around(mask: np.ndarray, margin: int | np.ndarray) -> tuple[slice, ...]:
    """Find the box around all of a mask, ``margin`` voxels wider (a number, or one for each axis) if there is room."""
    sides = ndimage.find_objects(mask.astype(np.uint8))[0]
    margins = np.broadcast_to(margin, mask.ndim).tolist()
    return tuple(slice(max(side.start - n, 0), side.stop + n) for side, n in zip(sides, margins, strict=True))


# voxels along each side of the grid that the change is looked for on: it is slow, and a finer grid takes minutes
_SHRUNK_VOXELS, _ITERATIONS = 24, (30, 30)


def even_brightness(image: Image) -> Image:
    """Divide an MRI by the slow change of its brightness: N4 (Tustison et al., IEEE Trans. Med. Imaging 29(6), 2010).

    The change is looked for where the grey values are above Otsu's threshold, on a grid of 24 voxels a side at most.
    The median there stays. Without it one range of grey values cannot fit an organ that is nearer to a coil at one end.
    """
    import SimpleITK

    values = np.maximum(image.hu.astype(np.float32), 0)
    scan = SimpleITK.GetImageFromArray(values)
    scan.SetSpacing((1e3 * image.spacing_m).tolist())
    coarse = SimpleITK.Shrink(scan, [-(-count // _SHRUNK_VOXELS) for count in scan.GetSize()])
    body = SimpleITK.OtsuThreshold(coarse, 0, 1)
    finder = SimpleITK.N4BiasFieldCorrectionImageFilter()
    finder.SetNumberOfThreads(1)
    finder.SetMaximumNumberOfIterations(list(_ITERATIONS))
    finder.Execute(coarse, body)
    log_bias = SimpleITK.GetArrayFromImage(finder.GetLogBiasFieldAsImage(scan))
    even = values / np.exp(log_bias)
    tissue = SimpleITK.GetArrayFromImage(SimpleITK.OtsuThreshold(scan, 0, 1)) > 0
    return replace(image, hu=(even * (np.median(values[tissue]) / np.median(even[tissue]))).astype(np.float32))


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
    box = box_around(np.asarray(slices.any(axis=0)), 1)
    depth = partial(ndimage.distance_transform_edt, sampling=steps)  # [m] from the outline of a slice
    depths = np.array([depth(slices[number][box]) - depth(~slices[number][box]) for number in drawn])
    positions = np.array([2 * drawn[0] - drawn[1], *drawn, 2 * drawn[-1] - drawn[-2]])
    before_first, after_last = (depths[end] - depths[end].max() for end in (0, -1))
    curve = Akima1DInterpolator(positions, np.stack([before_first, *depths, after_last]), axis=0)
    filled = slices.copy()
    for number in range(max(positions[0] + 1, 0), min(positions[-1], len(slices))):
        if number not in drawn:
            filled[number][box] = curve(number) > 0
    return np.moveaxis(filled, 0, along)


def undrawn_across(mask: np.ndarray) -> str | None:
    """Return the axis across which no slice of a mask has a neighbour, as if every n-th was drawn; None if none is."""
    for axis, along in zip("zyx", range(3), strict=True):
        has_voxels = np.asarray(mask.any(axis=tuple(other for other in range(3) if other != along)))
        if has_voxels.sum() > 1 and not (has_voxels[1:] & has_voxels[:-1]).any():
            return axis
    return None
