"""The border of an organ in a CT where its grey values are half those of what lies beside it."""

import numpy as np
from scipy import ndimage


def at_half_level(organ: np.ndarray, soft: np.ndarray, spacing: np.ndarray, threshold_hu) -> np.ndarray:
    """``organ`` grown or cut to where ``soft`` is midway between inside and outside, both (nz, ny, nx).

    soft : [HU], the CT blurred by a voxel of the finest spacing; spacing : (3,) [m] along z, y and x
    A fixed lower threshold takes from an organ in fat or air what it shares with them in the voxels of its border.
    So each voxel about the border goes to the nearer, in HU, of two others: the nearest one well inside and the nearest
    one well outside. Where the one outside is in the organ's range ``threshold_hu``, they say nothing, and the border
    stays where it was.
    """
    # the border is blurred over as much: once by the scanner, which averages over a voxel, and twice by a deviation
    steps = spacing / (spacing + 2 * spacing.min())
    inside = ndimage.distance_transform_edt(organ, steps) >= 1
    outside = ndimage.distance_transform_edt(~organ, steps) >= 1
    if not (inside.any() and outside.any()):
        return organ
    within, beside = (
        soft[tuple(ndimage.distance_transform_edt(~far, steps, return_distances=False, return_indices=True))]
        for far in (inside, outside)
    )
    low, high = threshold_hu
    told = ~inside & ~outside & ((beside < low) | (beside > high))
    return np.where(told, np.abs(soft - within) < np.abs(soft - beside), organ)
