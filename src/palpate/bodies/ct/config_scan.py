"""Read the scan, the mask and the labelled regions that the settings of a body of kind ct name."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.headers import angle_deg
from palpate.bodies.ct.image import Image, choose, read, read_mask
from palpate.bodies.ct.segmentation import even_brightness, fill_between, undrawn_across
from palpate.bodies.ct.synthetic_abdomen import LABELS, abdomen, mri_abdomen
from palpate.bodies.settings import Ct, Labels
from palpate.errors import InputError


def scan_of(entry: Ct) -> Image:
    """Read the image that the settings name, or the synthetic abdomen; even an MRI's brightness if they ask for it.

    Raises InputError if the file is not what ``modality`` says.
    """
    if entry.image is None:
        image = abdomen()[0] if entry.modality == "ct" else mri_abdomen()[0]
    else:
        image = read(entry.image, entry.modality)
    if not entry.even_brightness:
        return image
    if entry.modality == "ct":
        raise InputError(f"{image.source}: even_brightness is for an MRI, as CT numbers are absolute; leave it out.")
    return even_brightness(image)


_LAY = {"S": "back", "P": "front", "DR": "right", "DL": "left"}
"""The patient's side below, by how a position ends in DICOM: supine, prone, or on a side; HF is head first."""


def described(entry: Ct) -> tuple[list[str], str]:
    """Describe in lines what is read from scan and mask; also return the side that the patient lies on, or ""."""
    with warnings.catch_warnings(action="ignore"):  # they come again when the body is made
        image = scan_of(entry)
        mask = mask_of(entry, image, entry.label) if entry.mask is not None else None
    counts, steps = ("×".join(f"{n:.4g}" for n in each) for each in (image.hu.shape[::-1], 1e3 * image.spacing_m))
    oblique_deg = angle_deg(image.axes, np.eye(3))
    orientation = f"{oblique_deg:.3g}° oblique" if oblique_deg else "upright"
    side_below = _LAY.get(image.position[2:], "")
    lines = [f"{image.source}: {counts} voxels of {steps} mm, axes from the {image.frame or 'voxels'}, {orientation}"]
    if side_below:
        lines.append(f"{image.source}: the patient lay on the {side_below} ({image.position})")
    if mask is not None:
        lines.append(f"{entry.mask}: what is taken of it has {1e6 * mask.sum() * image.voxel_m3:.4g} mL")
    return lines, side_below


def mask_of(entry: Ct, image: Image, label: Labels | None) -> np.ndarray:
    """Read labels of the mask, (nz, ny, nx) bool, filled between the slices that were drawn.

    Raises InputError if only some slices are drawn and there are no ``drawn_slices``.
    """
    path = Path(entry.mask or "")
    mask = read_mask(path, image, label)
    if entry.drawn_slices:
        return fill_between(mask, image, entry.drawn_slices, path)
    if axis := undrawn_across(mask):
        raise InputError(
            f"{path}: the mask is drawn on some slices only, with empty ones between; "
            f"give drawn_slices: {axis} to have them filled, or a whole mask."
        )
    return mask


def label_region(entry: Ct, label: Labels) -> Callable[[np.ndarray], np.ndarray]:
    """Return the test whether points (n, 3) [m] lie in voxels of a label, (n,) bool.

    label : number or name of a label of the mask, or several to join; without an image, of the synthetic
        abdomen (1 liver, 2 lesion)
    Raises InputError if the mask has no such label, or if there is no mask.
    """
    image, voxels = _voxels(entry, label)
    return lambda points: ndimage.map_coordinates(voxels, image.to_index(points).T, order=0, mode="grid-constant")


def label_ball(entry: Ct, label: Labels) -> tuple[np.ndarray, float]:
    """Return the middle (3,) [m] of a label's voxels, and the radius [m] of the ball of their volume."""
    image, voxels = _voxels(entry, label)
    middle = image.to_world(np.argwhere(voxels).mean(axis=0))
    return middle, float(np.cbrt(0.75 / np.pi * voxels.sum() * image.voxel_m3))


def _voxels(entry: Ct, label: Labels) -> tuple[Image, np.ndarray]:
    """Return the image, and the voxels (nz, ny, nx) bool of a label of the body's mask."""
    if entry.image is None:
        image, truth = abdomen()
        return image, choose(Path(image.source), truth["labels"], LABELS, label, image.voxel_m3)
    image = scan_of(entry)
    if entry.mask is None:
        raise InputError(f"{image.source}: a region by label needs the body's mask; give one that has the label.")
    return image, mask_of(entry, image, label)
