"""Classification of CT values in a volume rendering: gap, skin, muscle, bone or organ (paper 3, chapter 2)."""

import numpy as np

from palpate.bodies.ct.image import Image

_SKIN, _MUSCLE, _BONE, _ORGAN = (0.98, 0.85, 0.76), (0.66, 0.32, 0.26), (0.96, 0.95, 0.92), (0.70, 0.20, 0.15)
_ORGAN_HU, _GAP_HU, _DARK_HU, _BRIGHT_HU = -3000, -1000, -250, 0

CLASSES = [
    (_ORGAN_HU, _ORGAN, 0.70),
    (-1600, _ORGAN, 0.70),
    (-1300, _SKIN, 0.0),
    (-400, _SKIN, 0.0),
    (-250, _SKIN, 0.006),
    (-60, _SKIN, 0.004),
    (0, _MUSCLE, 0.012),
    (130, _MUSCLE, 0.016),
    (220, _BONE, 0.06),
    (500, _BONE, 0.60),
]
"""Corners of the classification: value, colour, opacity per millimetre. Gaps and lungs are transparent, skin and fat
light and nearly transparent, muscle is darker, bone grey-white."""


def values(image: Image, mask: np.ndarray) -> np.ndarray:
    """Compute the values for CLASSES, (nz, ny, nx) int16: CT numbers [HU], and far below all of them in the organ.

    An MRI's tissue, where it is brighter than Otsu's threshold, gets values of skin to muscle by its brightness.
    The mask's steps between slices are smoothed, because shading would show them. Trap: the organ's values must lie
    below those of gaps, so that interpolation between the organ and its neighbours gives no other opaque class.
    """
    from scipy import ndimage

    blur = 0.5 * max(image.spacing_m) / np.array(image.spacing_m[::-1])
    share = ndimage.gaussian_filter(mask.astype(np.float32), blur)
    return np.rint(share * _ORGAN_HU + (1 - share) * np.minimum(_numbers(image), CLASSES[-1][0])).astype(np.int16)


def _numbers(image: Image) -> np.ndarray:
    """Return the CT numbers, or for an MRI values between those of gaps and of muscle."""
    if image.modality == "ct":
        return image.hu
    import SimpleITK

    grey = image.hu.astype(np.float32)
    tissue = SimpleITK.GetArrayFromImage(SimpleITK.OtsuThreshold(SimpleITK.GetImageFromArray(grey), 0, 1)) > 0
    if not tissue.any():
        return np.full_like(grey, _GAP_HU)
    low, high = np.percentile(grey[tissue], [0, 99])
    return np.where(tissue, np.interp(grey, [low, max(high, low + 1e-6)], [_DARK_HU, _BRIGHT_HU]), _GAP_HU)
