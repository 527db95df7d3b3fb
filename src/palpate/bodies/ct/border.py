"""Border of an organ in a CT at the grey value midway between the organ and its neighbourhood."""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage


def move_to_half_level(
    organ: np.ndarray, smooth: np.ndarray, spacing: np.ndarray, threshold_hu: Sequence[float]
) -> np.ndarray:
    """Move the border of ``organ`` to where ``smooth`` is midway between inside and outside, both (nz, ny, nx).

    smooth : [HU], the CT blurred by a voxel of the finest spacing; spacing : (3,) [m] along z, y and x
    A fixed lower threshold cuts the border voxels, which an organ in fat or air shares with them, from the organ. So
    each voxel near the border goes to whichever is nearer in HU: the nearest voxel well inside, or the nearest
    one well outside. Where the latter is within the organ's range ``threshold_hu``, the grey values do not distinguish
    the two, and the border stays.
    """
    # width of the blurred border: one voxel from the scanner's averaging, and twice the deviation of the blur
    steps = spacing / (spacing + 2 * spacing.min())
    inside = ndimage.distance_transform_edt(organ, steps) >= 1
    outside = ndimage.distance_transform_edt(~organ, steps) >= 1
    if not (inside.any() and outside.any()):
        return organ
    inside_hu, outside_hu = (
        smooth[tuple(ndimage.distance_transform_edt(~far, steps, return_distances=False, return_indices=True))]
        for far in (inside, outside)
    )
    low, high = threshold_hu
    decided = ~inside & ~outside & ((outside_hu < low) | (outside_hu > high))
    return np.where(decided, np.abs(smooth - inside_hu) < np.abs(smooth - outside_hu), organ)
