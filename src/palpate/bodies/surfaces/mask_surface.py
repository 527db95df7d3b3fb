"""Closed surface of a mask: dense and smooth as in the CT, or with a given number of nodes."""

from typing import Protocol

import numpy as np
from scipy.ndimage import gaussian_filter, zoom

from palpate.bodies.surfaces.decimate import area_normals, remesh
from palpate.bodies.surfaces.isosurface import isosurface
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.bodies.surfaces.volume import inflate, signed_volumes, volume
from palpate.errors import InputError

# blur of the mask and spacing of the samples that a remeshing starts from, relative to the desired edge length
BLUR, STEP = 0.2, 0.25
MAX_SAMPLES = 4e8  # 1.6 GB
# fractions of the volume that may be in other pieces of the blurred mask, and missing from a coarse sampling of it
LOST, LOST_COARSE = 0.02, 0.1

# search for the level that keeps the volume: initial levels, iterations at most, relative tolerance
LEVELS, SECANTS, TOLERANCE = (0.45, 0.5), 8, 1e-4


class Grid(Protocol):
    """Places of a mask's voxels: a CT's image, or a grid around a surface."""

    @property
    def spacing_m(self) -> np.ndarray: ...

    @property
    def voxel_m3(self) -> float: ...

    @property
    def source(self) -> str: ...

    def to_world(self, index: np.ndarray) -> np.ndarray: ...


def surface(mask: np.ndarray, image: Grid, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Build a surface with the volume of the mask's voxels: points (nodes, 3) [m], triangles wound outward."""
    points, triangles = coarse_surface(mask, image, nodes)
    return inflate(points, triangles, mask.sum() * image.voxel_m3), triangles


def coarse_surface(mask: np.ndarray, image: Grid, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Build a surface whose points lie on the mask's surface, so that its volume is some per cent too small.

    Parts thinner than a fraction of an edge cannot be resolved by so few nodes, and are first removed by blurring.
    """
    area = np.linalg.norm(area_normals(*dense_surface(mask, image)), axis=1).sum() / 2
    edge = float(np.sqrt(2 * area / (3**0.5 * nodes)))
    blurred, origin, spacing = _blur(mask, image, BLUR * edge)
    mask_volume = mask.sum() * image.voxel_m3
    level, dense = _find_level(blurred, origin, spacing, mask_volume)
    samples = np.prod(np.array(blurred.shape) * spacing[::-1] / (STEP * edge))
    if samples > MAX_SAMPLES:
        raise InputError(
            f"{image.source}: surface_nodes is {nodes}, which are too many for this organ: their triangles would be "
            f"{1e3 * edge:.2g} mm wide and the voxels are {1e3 * spacing.min():.2g} mm; give fewer surface_nodes."
        )
    even = zoom(blurred, spacing[::-1] / (STEP * edge), order=1, grid_mode=False)
    stretched = spacing * (np.array(blurred.shape[::-1]) - 1) / (np.array(even.shape[::-1]) - 1)
    start = _contour(even, level, origin, stretched)
    if volume(*dense) < (1 - LOST) * mask_volume or volume(*start) < (1 - LOST_COARSE) * mask_volume:
        raise InputError(
            f"{image.source}: {nodes} surface nodes are too few for this organ, parts of which they cannot resolve; "
            "give more surface_nodes."
        )
    return remesh(*start, *dense, nodes)


def dense_surface(mask: np.ndarray, image: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Build the mask's smooth surface: (n, 3) [m] and (m, 3), of one piece, without cavities, wound outward."""
    mask_volume = mask.sum() * image.voxel_m3
    points, triangles = _find_level(*_blur(mask, image, 0.0), mask_volume)[1]
    if volume(points, triangles) < (1 - LOST) * mask_volume:
        raise InputError(
            f"{image.source}: the organ is too thin for its slices, and falls apart when they are smoothed; "
            "give thinner slices or another mask."
        )
    return points, triangles


def _blur(mask: np.ndarray, image: Grid, blur_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blur the mask (z, y, x) until no step between slices remains; also return its origin and its spacing [m]."""
    spacing = image.spacing_m[::-1]
    blur = max(blur_m, image.spacing_m.max()) / spacing
    margin = np.ceil(4 * blur).astype(int) + 1
    places = np.argwhere(mask)
    low, high = places.min(axis=0), places.max(axis=0) + 1
    box = mask[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    blurred = gaussian_filter(np.pad(box, margin[:, None]).astype(np.float32), blur)
    return blurred, image.to_world(low - margin), image.spacing_m


def _find_level(
    blurred: np.ndarray, origin: np.ndarray, spacing: np.ndarray, volume_m3: float
) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    """Find the level whose isosurface has the given volume, so that blurring keeps the volume; return both.

    Secant method, as the volume is almost linear in the level. Where pieces detach it is not, and the surface
    returned may lack them.
    """
    other, level = LEVELS
    other_missing = volume(*_contour(blurred, other, origin, spacing)) - volume_m3
    for _ in range(SECANTS):
        found = level, _contour(blurred, level, origin, spacing)
        missing = volume(*found[1]) - volume_m3
        if abs(missing) <= TOLERANCE * volume_m3 or missing == other_missing:
            break
        step = missing * (level - other) / (missing - other_missing)
        other, other_missing = level, missing
        level = float(np.clip(level - step, 0.1, 0.9))
    return found


def _contour(
    blurred: np.ndarray, level: float, origin: np.ndarray, spacing: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Extract the largest piece of an isosurface; empty if nothing is above the level, as where a slice was blurred."""
    points, triangles, _ = isosurface(blurred, level, origin, spacing)
    return _keep_largest(points, triangles) if len(triangles) else (points, triangles)


def _keep_largest(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Keep the piece of the surface with the largest volume, wound outward, without cavities and islands."""
    piece = label_shells(triangles, len(points))
    sizes = np.bincount(piece, signed_volumes(points, triangles))
    kept = triangles[piece == np.argmax(np.abs(sizes))]
    kept = kept if sizes[np.argmax(np.abs(sizes))] > 0 else kept[:, ::-1]
    used, number = np.unique(kept, return_inverse=True)
    return points[used], number.reshape(-1, 3)
