"""The scan, mask and labelled regions that an entry of the config names, evened and completed if it asks so."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.interpolate import Akima1DInterpolator

from palpate.bodies.ct.image import Image, choose, read, read_mask
from palpate.bodies.ct.segmentation import box_around
from palpate.bodies.ct.synthetic_abdomen import LABELS, abdomen, mri_abdomen
from palpate.errors import InputError

# voxels along each side of the grid that the change is looked for on: it is slow, and a finer grid takes minutes
_SHRUNK_VOXELS, _ITERATIONS = 24, (30, 30)


def even_brightness(image: Image) -> Image:
    """Divide an MRI by the slow change of its brightness: N4 (Tustison et al., IEEE Trans. Med. Imaging 29(6), 2010).

    The change is looked for where the grey values are above Otsu's threshold, on a grid of 24 voxels a side at most.
    The median there stays. Without it one range of grey values cannot fit an organ that is nearer to a coil at one end.
    """
    import SimpleITK

    grey = np.maximum(image.hu.astype(np.float32), 0)
    found = SimpleITK.GetImageFromArray(grey)
    found.SetSpacing((1e3 * image.spacing_m).tolist())
    coarse = SimpleITK.Shrink(found, [-(-count // _SHRUNK_VOXELS) for count in found.GetSize()])
    body = SimpleITK.OtsuThreshold(coarse, 0, 1)
    finder = SimpleITK.N4BiasFieldCorrectionImageFilter()
    finder.SetNumberOfThreads(1)
    finder.SetMaximumNumberOfIterations(list(_ITERATIONS))
    finder.Execute(coarse, body)
    change = SimpleITK.GetArrayFromImage(finder.GetLogBiasFieldAsImage(found))
    even = grey / np.exp(change)
    inside = SimpleITK.GetArrayFromImage(SimpleITK.OtsuThreshold(found, 0, 1)) > 0
    return replace(image, hu=(even * (np.median(grey[inside]) / np.median(even[inside]))).astype(np.float32))


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


def _signed_distance(drawn: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the distance [m] to the outline of a slice, (n, m): positive inside."""
    return ndimage.distance_transform_edt(drawn, steps) - ndimage.distance_transform_edt(~drawn, steps)


def scan_of(entry: dict) -> Image:
    """Read the image of a config entry of kind ct, by default the synthetic abdomen; an MRI evened if it is asked for.

    Raises InputError if the file is not what ``entry["modality"]`` says.
    """
    modality = entry.get("modality", "ct")
    if entry.get("image") is None:
        image = abdomen()[0] if modality == "ct" else mri_abdomen()[0]
    else:
        image = read(entry["image"], modality)
    if not entry.get("even_brightness"):
        return image
    if modality == "ct":
        raise InputError(f"{image.source}: even_brightness is for an MRI, as CT numbers are absolute; leave it out.")
    return even_brightness(image)


def mask_of(entry: dict, image: Image, label: int | str | Sequence[int | str] | None) -> np.ndarray:
    """Read labels of the entry's mask, (nz, ny, nx) bool, filled between the slices that were drawn.

    Raises InputError if only some slices are drawn and the entry has no ``drawn_slices``.
    """
    path = Path(entry["mask"])
    mask = read_mask(path, image, label)
    if entry.get("drawn_slices"):
        return fill_between(mask, image, entry["drawn_slices"], path)
    if axis := undrawn_across(mask):
        raise InputError(
            f"{path}: the mask is drawn on some slices only, with empty ones between; "
            f"give drawn_slices: {axis} to have them filled, or a whole mask."
        )
    return mask


def label_region(entry: dict, label: int | str | Sequence[int | str]) -> Callable[[np.ndarray], np.ndarray]:
    """Return the test whether points (n, 3) [m] lie in voxels of a label, (n,) bool, for a config entry of kind ct.

    label : number or name of a label of ``entry["mask"]``, or several to join; without an image, of the synthetic
        abdomen (1 liver, 2 lesion)
    Raises InputError if the mask has no such label, or if there is no mask.
    """
    image, voxels = _voxels(entry, label)

    def inside(points: np.ndarray) -> np.ndarray:
        index = np.rint(image.to_index(points)).astype(int)
        within = ((index >= 0) & (index < voxels.shape)).all(axis=1)
        found = np.zeros(len(points), dtype=bool)
        found[within] = voxels[tuple(index[within].T)]
        return found

    return inside


def label_ball(entry: dict, label: int | str | Sequence[int | str]) -> tuple[np.ndarray, float]:
    """Return the middle (3,) [m] of a label's voxels, and the radius [m] of the ball of their volume."""
    image, voxels = _voxels(entry, label)
    middle = image.to_world(np.argwhere(voxels).mean(axis=0))
    return middle, float(np.cbrt(0.75 / np.pi * voxels.sum() * image.voxel_m3))


def _voxels(entry: dict, label: int | str | Sequence[int | str]) -> tuple[Image, np.ndarray]:
    if entry.get("image") is None:
        image, truth = abdomen()
        return image, choose(Path(image.source), truth["labels"], LABELS, label, image.voxel_m3)
    image = scan_of(entry)
    if entry.get("mask") is None:
        raise InputError(f"{image.source}: a region by label needs the body's mask; give one that has the label.")
    return image, mask_of(entry, image, label)
