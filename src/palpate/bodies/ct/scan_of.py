"""The scan and the mask that an entry of the config names."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.bodies.ct.drawn_slices import fill_between, undrawn_across
from palpate.bodies.ct.even_brightness import even_brightness
from palpate.bodies.ct.image import Image, read, read_mask
from palpate.bodies.ct.synthetic_abdomen import abdomen, mri_abdomen
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
