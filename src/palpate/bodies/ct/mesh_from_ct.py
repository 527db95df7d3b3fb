"""From a CT to a body's coarse mesh, and on to the surface that its finer meshes may follow."""

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from palpate.bodies.ct.image import Image, read, read_mask
from palpate.bodies.ct.mask_surface import coarse_surface, dense_surface, inflate
from palpate.bodies.ct.segmentation import on_border, segment, whole
from palpate.bodies.ct.snap import snapper
from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.bodies.mesh import TetMesh
from palpate.bodies.surfaces.tetrahedralize import fill
from palpate.errors import InputError

# vertices more than asked for that are still the surface that was asked for
MORE = 1.2


def segmented(entry: dict) -> tuple[Image, np.ndarray]:
    """The CT of a config entry and its organ, (nz, ny, nx) bool, of one piece; the synthetic abdomen without a file.

    Warns if the organ reaches the border of the image, which has then probably cut it, and of pieces of a mask that
    are left out.
    """
    image = read(entry["image"]) if entry.get("image") is not None else abdomen()[0]
    mask = read_mask(entry["mask"], image) if entry.get("mask") is not None else None
    if entry.get("crop_m"):
        box = _box(image, np.array(entry["crop_m"], dtype=float))
        mask = mask[box] if mask is not None else None
        start = [side.start for side in box]
        image = replace(image, hu=image.hu[box], origin_m=image.to_world(start))
    mask = _kept(mask, image, entry["mask"]) if mask is not None else segment(image, entry)
    if not mask.any():
        raise InputError(f"{image.source}: crop_m leaves nothing of the mask; give a box [m] around the organ.")
    if on_border(mask):
        warnings.warn(
            f"{image.source}: the organ reaches the border of the image, which has probably cut it; "
            "the body ends there in a flat face.",
            stacklevel=2,
        )
    return image, mask


def mesh(entry: dict) -> TetMesh:
    """The coarse mesh of a config entry of kind ct."""
    return build(entry)[0]


def build(entry: dict) -> tuple[TetMesh, Callable | None]:
    """The coarse mesh, and with ``entry["snap"]`` what moves a finer mesh's new nodes to the CT's surface.

    Without ``snap`` every level has the volume of the mask's voxels. With it the coarse nodes stay on the CT's
    surface, so that the coarse body is some percent too small and each finer one less.
    """
    image, mask = segmented(entry)
    wanted = entry["surface_nodes"]
    points, triangles = coarse_surface(mask, image, wanted)
    more = f"{image.source}: {wanted} surface nodes are too few for this organ; give more surface_nodes"
    if len(points) > MORE * wanted:
        raise InputError(f"{more} (it needs {len(points)} without a fold or a bridge closed).")
    if not entry.get("snap"):
        points = inflate(points, triangles, mask.sum() * image.voxel_m3)
    try:
        filled = fill(points, triangles, source=image.source)
    except InputError as error:
        raise InputError(f"{more}, since it cuts through itself where it is thin.") from error
    return filled, snapper(*dense_surface(mask, image)) if entry.get("snap") else None


def _kept(mask: np.ndarray, image: Image, source) -> np.ndarray:
    """The largest piece of a given mask, hollows filled; warns if there were others."""
    kept = whole(mask)
    rest, most = (1e6 * part.sum() * image.voxel_m3 for part in (mask & ~kept, kept))
    if rest > 0:
        warnings.warn(
            f"{source}: the mask is in several pieces, of which the largest is kept ({most:.4g} mL) and "
            f"the others are dropped ({rest:.2g} mL).",
            stacklevel=3,
        )
    return kept


def _box(image: Image, corners: np.ndarray) -> tuple[slice, ...]:
    """The voxels between two corners, (2, 3) [m], cut off at the image's border."""
    shape = np.array(image.hu.shape)
    low, high = np.sort(image.to_index(corners), axis=0)
    first, last = np.maximum(np.ceil(low), 0).astype(int), np.minimum(np.floor(high), shape - 1).astype(int)
    if (last < first).any():
        ends = image.to_world(np.array([np.zeros(3), shape - 1]))
        told = " to ".join("({:.3f}, {:.3f}, {:.3f})".format(*end) for end in ends)
        raise InputError(f"{image.source}: crop_m has no voxel inside; the image reaches from {told} m.")
    return tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
