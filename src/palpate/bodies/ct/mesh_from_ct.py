"""Coarse mesh of a body from a CT or an MRI, and the snapping of its finer meshes to the image's surface."""

import warnings
from collections.abc import Sequence
from itertools import product

import numpy as np

from palpate.bodies.ct.config_scan import mask_of, scan_of
from palpate.bodies.ct.image import AIR_HU, Image
from palpate.bodies.ct.segmentation import largest_filled, segment
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import Snap
from palpate.bodies.regions import balls_of
from palpate.bodies.settings import Ct
from palpate.bodies.surfaces.mask_surface import coarse_shell, dense_surface, fill
from palpate.bodies.surfaces.snap import snapper
from palpate.bodies.surfaces.triangles import inflate, vertex_normals
from palpate.errors import InputError

_SIDES = (("feet", "head"), ("front", "back"), ("right", "left"))
"""Of the patient, at the first and the last index along z, y and x."""
LEAST_M2 = 1e-4
"""Area of contact with padding from which on it counts: single voxels of air may touch an organ."""


def cut_off(image: Image, mask: np.ndarray, whole: Sequence[int], start: Sequence[int]) -> list[str]:
    """List where an organ ``mask``, (nz, ny, nx) bool, ends at a border of the image, with each cut's area.

    whole, start : voxels of the image before it was cropped, and index of the first one that was kept, z y x
    Besides the borders of the image there is the padding around the circle that a scanner sees.
    """
    borders = []
    # of a voxel's face across each axis of the array
    face_m2 = [image.voxel_m3 / float(spacing) for spacing in image.spacing_m[::-1]]
    for axis, sides in enumerate(_SIDES):
        for end, side in zip((0, -1), sides, strict=True):
            area = float(mask.take(end, axis).sum() * face_m2[axis])
            by_crop = start[axis] > 0 if end == 0 else start[axis] + mask.shape[axis] < whole[axis]
            if area:
                borders.append(f"{'crop_m' if by_crop else 'the image'} towards the {side} ({_cm2(area)})")
    if image.modality != "ct":
        return borders
    area, padding = 0.0, image.hu <= AIR_HU
    for axis in range(3):
        organ, pad = np.moveaxis(mask, axis, 0), np.moveaxis(padding, axis, 0)
        touching = (organ[1:] & pad[:-1]).sum() + (organ[:-1] & pad[1:]).sum()
        area += float(touching * face_m2[axis])
    if area >= LEAST_M2:
        borders.append(f"the padding around the scanned circle ({_cm2(area)})")
    return borders


def _cm2(area_m2: float) -> str:
    return f"{1e4 * area_m2:.0f} cm²" if area_m2 >= 1e-3 else f"{1e4 * area_m2:.2g} cm²"


THINNEST = 4
"""Voxels along each side of an organ with which there is a surface on both sides of some inside."""


def segment_entry(entry: Ct) -> tuple[Image, np.ndarray]:
    """Segment the scan of a body, by default the synthetic abdomen: image and organ, (nz, ny, nx) bool.

    The organ is of one piece. Warns if the image or its crop cuts it off, and if pieces of a mask are left out.
    """
    image = scan_of(entry)
    mask = mask_of(entry, image, entry.label) if entry.mask is not None else None
    full_shape, start = image.hu.shape, [0, 0, 0]
    if entry.crop_m:
        box = _crop_box(image, np.array(entry.crop_m, dtype=float))
        mask = mask[box] if mask is not None else None
        start = [side.start for side in box]
        image = image.cropped(box)
    limits = entry.threshold_hu if image.modality == "ct" else entry.threshold
    if mask is not None:
        mask = _largest_piece(mask, image, str(entry.mask))
    elif limits is not None:
        mask = segment(image, limits)
    else:
        raise InputError(
            f"{image.source}: grey values of an MRI have no unit, so threshold_hu says nothing of them; "
            "give threshold, the lowest and the highest one of the organ, or a mask."
        )
    if not mask.any():
        raise InputError(f"{image.source}: crop_m leaves nothing of the mask; give a box [m] around the organ.")
    if cuts := cut_off(image, mask, full_shape, start):
        warnings.warn(
            f"{image.source}: the organ is cut off by {', '.join(cuts)}; the body ends there in a flat face, and lacks "
            "what lies beyond.",
            stacklevel=2,
        )
    return image, mask


def build(entry: Ct) -> tuple[TetMesh, Snap | None]:
    """Build the coarse mesh and, with ``snap``, a function that snaps finer meshes to the CT's surface.

    Without ``snap`` every level has the volume of the mask's voxels. With it the coarse nodes stay on the CT's
    surface, so that the coarse body is some per cent too small and each finer one less so.
    """
    image, mask = segment_entry(entry)
    refuse_thin(image, mask)
    wanted = entry.surface_nodes
    points, triangles = coarse_shell(mask, image, wanted)
    if not entry.snap:
        points = inflate(points, triangles, mask.sum() * image.voxel_m3)
    filled = fill(points, triangles, image, wanted, balls=balls_of(entry))
    if not entry.snap:
        return filled, None
    dense, corners = dense_surface(mask, image)
    return filled, snapper(dense, vertex_normals(dense, corners))


def refuse_thin(image: Image, mask: np.ndarray) -> None:
    """Raise InputError for an organ fewer than THINNEST voxels thick along an axis, so that no inside is seen."""
    for axis, name in enumerate("zyx"):
        thick = int(mask.any(axis=tuple({0, 1, 2} - {axis})).sum())
        if thick < THINNEST:
            raise InputError(
                f"{image.source}: the organ is {thick} voxels thick along {name}, and {THINNEST} are needed at least; "
                "give an image with more slices through the organ, or another label or threshold."
            )


def _largest_piece(mask: np.ndarray, image: Image, source: str) -> np.ndarray:
    """Keep the largest piece of a given mask, cavities filled; warn if there were others."""
    largest = largest_filled(mask)
    dropped_ml, kept_ml = (1e6 * piece.sum() * image.voxel_m3 for piece in (mask & ~largest, largest))
    if dropped_ml > 0:
        warnings.warn(
            f"{source}: the mask is in several pieces, of which the largest is kept ({kept_ml:.4g} mL) and "
            f"the others are dropped ({dropped_ml:.2g} mL).",
            stacklevel=3,
        )
    return largest


def _crop_box(image: Image, corners: np.ndarray) -> tuple[slice, ...]:
    """Find the voxels of the grid's smallest box around two opposite corners, (2, 3) [m], clipped to the image."""
    shape = np.array(image.hu.shape)
    indices = image.to_index(np.array(list(product(*corners.T))))
    lowest, highest = indices.min(axis=0), indices.max(axis=0)
    start, stop = np.maximum(np.ceil(lowest), 0).astype(int), np.minimum(np.floor(highest), shape - 1).astype(int)
    if (stop < start).any():
        indices = image.to_world(np.array(list(np.ndindex(2, 2, 2))) * (shape - 1))
        extent = " to ".join("({:.3f}, {:.3f}, {:.3f})".format(*end(indices, axis=0)) for end in (np.min, np.max))
        raise InputError(f"{image.source}: crop_m has no voxel inside; the image reaches from {extent} m.")
    return tuple(slice(a, b + 1) for a, b in zip(start, stop, strict=True))
