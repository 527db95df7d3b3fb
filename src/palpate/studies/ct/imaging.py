"""Steps from a scan to a picture and a mask that paper 3 describes in chapter 2, each against what is known."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.studies.ct import classified_voxels, compositing, mask_interpolation, segmented_scans, surface_normals
from palpate.studies.ct.ray_casting import Rays, cast, field_of, front, parallel_rays
from palpate.studies.ct.tissue_classes import by_threshold, transfer_of

STEP = 0.5
"""Of the smallest side of a voxel, between samples along a ray."""
ENOUGH = 0.99
"""Opacity at which rays of the pictures end."""


class Pictures(NamedTuple):
    """Material of the figure: ``cast``, pictures by caption (height, width, 3), and the share of samples ``taken``.

    mris : the MRI as it is and evened, each with the liver that is found (nz, ny, nx) and the true one
    """

    cast: dict[str, np.ndarray]
    taken: np.ndarray
    mris: list[tuple[Image, np.ndarray]]
    liver: np.ndarray


def measure(
    masks: Mapping[str, tuple[Image, np.ndarray]],
    every: Sequence[int],
    pixels: int,
    voxel_m: float,
    progress: Callable = iter,
) -> tuple[dict[str, pd.DataFrame], Pictures]:
    """Measure the tables of the imaging part by name, and what to draw.

    masks : image and organ of each body; pixels : across the pictures that are timed; voxel_m : side of the voxels of
    the synthetic scans, whose truth is known; progress : wraps the list of tables
    """
    image, truth = abdomen(spacing_m=(voxel_m,) * 3)
    found: dict[str, pd.DataFrame] = {}
    for name in progress(["mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing"]):
        if name == "mask_interpolation":
            parts = [mask_interpolation.measure(body, *scan, every) for body, scan in masks.items()]
            found[name] = pd.concat(parts, ignore_index=True)
        elif name == "surface_normals":
            found[name] = surface_normals.measure(image)
        elif name == "tissue_classes":
            found[name] = classified_voxels.measure(image)
        elif name == "segmented_scans":
            found[name], mris = segmented_scans.measure(image, truth["liver"])
        else:
            rays = parallel_rays(image, front(), pixels, STEP)
            found[name] = compositing.measure(field_of(image), rays, compositing.likely(image))
    return found, Pictures(*_pictures(image, rays), mris, truth["liver"])


def _pictures(image: Image, rays: Rays) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Cast the pictures that are drawn: classes by threshold and by probability, both orders of compositing."""
    field, likely = field_of(image), compositing.likely(image)
    sharp = transfer_of(compositing.GREY, by_threshold(compositing.GREY))
    back = cast(field, likely, rays, back_to_front=True)
    front_first, samples = cast(field, likely, rays, enough=ENOUGH)
    shape = rays.height, rays.width
    shown = {
        "classes by threshold": cast(field, sharp, rays)[0],
        "by probability, back to front": back[0],
        f"front to back, ends at {ENOUGH:g}": front_first,
    }
    pictures = {caption: compositing.on_white(found).reshape(*shape, 3) for caption, found in shown.items()}
    return pictures, (samples / np.maximum(back[1], 1)).reshape(shape)
