"""Read the scan, the mask and the labelled regions that an entry of the config of kind ct names."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from palpate.bodies.ct.image import Image, choose, read, read_mask
from palpate.bodies.ct.segmentation import even_brightness, fill_between, undrawn_across
from palpate.bodies.ct.synthetic_abdomen import LABELS, abdomen, mri_abdomen
from palpate.errors import InputError


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
