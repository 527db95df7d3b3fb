"""Region of an organ that a label of its CT's mask marks, such as a lesion."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.labels import choose
from palpate.bodies.ct.scan_of import mask_of, scan_of
from palpate.bodies.ct.synthetic_abdomen import LABELS, abdomen
from palpate.errors import InputError


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
