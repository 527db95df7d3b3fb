"""Closed surface of a mask: dense and smooth as in the CT, or coarse and filled with tetrahedra."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter, zoom

from palpate.bodies.ct.image import Grid
from palpate.bodies.ct.segmentation import box_around
from palpate.bodies.mesh import TetMesh, area_normals
from palpate.bodies.surfaces.remesh import remesh
from palpate.bodies.surfaces.tetrahedralize import Ball, label_shells, tetrahedralize
from palpate.bodies.surfaces.triangles import arrays, image_data, inflate, mean_edge, signed_volumes, volume
from palpate.errors import InputError


def isosurface(
    samples: np.ndarray, level: float, origin: np.ndarray, spacing: np.ndarray, normals: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Extract the surface where ``samples``, (nz, ny, nx), have a level: points (n, 3), triangles, normals (n, 3).

    origin, spacing : (3,) [m], x y z of the first sample and between samples
    normals : whether to compute unit normals, towards lower values; else they are empty
    Flying edges (Schroeder, Maynard, Geveci 2015), which finds marching cubes' triangles: crossings by linear
    interpolation along voxels' edges, normals by central differences that are interpolated likewise. Empty if nothing
    is above the level.
    """
    contour = image_data(samples, origin, spacing).contour(
        [level], method="flying_edges", compute_normals=normals, compute_scalars=False
    )
    if not contour.n_cells:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), np.empty((0, 3))
    slopes = np.asarray(contour.point_data["Normals"], dtype=float) if normals else np.empty((0, 3))
    return *arrays(contour), slopes


# blur of the mask and spacing of the samples that a remeshing starts from, relative to the desired edge length
BLUR, STEP = 0.2, 0.25
MAX_SAMPLES = 4e8  # 1.6 GB
# fractions of the volume that may be in other pieces of the blurred mask, and missing from a coarse sampling of it
LOST_VOLUME, LOST_VOLUME_COARSE = 0.02, 0.1

# search for the level that keeps the volume: initial levels, iterations at most, relative tolerance
LEVELS, SECANTS, TOLERANCE = (0.45, 0.5), 8, 1e-4


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
    sample_count = np.prod(np.array(blurred.shape) * spacing[::-1] / (STEP * edge))
    if sample_count > MAX_SAMPLES:
        raise InputError(
            f"{image.source}: surface_nodes is {nodes}, which are too many for this organ: their triangles would be "
            f"{1e3 * edge:.2g} mm wide and the voxels are {1e3 * spacing.min():.2g} mm; give fewer surface_nodes."
        )
    resampled = zoom(blurred, spacing[::-1] / (STEP * edge), order=1, grid_mode=False)
    even_spacing = spacing * (np.array(blurred.shape[::-1]) - 1) / (np.array(resampled.shape[::-1]) - 1)
    start = _contour(resampled, level, origin, even_spacing)
    if volume(*dense) < (1 - LOST_VOLUME) * mask_volume or volume(*start) < (1 - LOST_VOLUME_COARSE) * mask_volume:
        raise InputError(
            f"{image.source}: {nodes} surface nodes are too few for this organ, parts of which they cannot resolve; "
            "give more surface_nodes."
        )
    points, triangles = remesh(*start, *dense, nodes)
    return image.turned(points), triangles


def dense_surface(mask: np.ndarray, image: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Build the mask's smooth surface: (n, 3) [m] and (m, 3), of one piece, without cavities, wound outward."""
    mask_volume = mask.sum() * image.voxel_m3
    points, triangles = _find_level(*_blur(mask, image, 0.0), mask_volume)[1]
    if volume(points, triangles) < (1 - LOST_VOLUME) * mask_volume:
        raise InputError(f"{image.source}: {image.too_thin}.")
    return image.turned(points), triangles


def _blur(mask: np.ndarray, image: Grid, blur_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blur the mask (z, y, x) until no step between slices remains; also return its origin and its spacing [m]."""
    spacing = image.spacing_m[::-1]
    blur = max(blur_m, image.spacing_m.max()) / spacing
    margin = np.ceil(4 * blur).astype(int) + 1
    box = box_around(mask, 0)
    first_voxel = np.array([side.start for side in box])
    blurred = gaussian_filter(np.pad(mask[box], margin[:, None]).astype(np.float32), blur)
    return blurred, image.along_axes(first_voxel - margin), image.spacing_m


def _find_level(
    blurred: np.ndarray, origin: np.ndarray, spacing: np.ndarray, volume_m3: float
) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    """Find the level whose isosurface has the given volume, so that blurring keeps the volume; return both.

    Secant method, as the volume is almost linear in the level. Where pieces detach it is not, and the surface
    returned may lack them.
    """
    previous_level, level = LEVELS
    previous_missing = volume(*_contour(blurred, previous_level, origin, spacing)) - volume_m3
    for _ in range(SECANTS):
        best = level, _contour(blurred, level, origin, spacing)
        missing = volume(*best[1]) - volume_m3
        if abs(missing) <= TOLERANCE * volume_m3 or missing == previous_missing:
            break
        step = missing * (level - previous_level) / (missing - previous_missing)
        previous_level, previous_missing = level, missing
        level = float(np.clip(level - step, 0.1, 0.9))
    return best


def _contour(
    blurred: np.ndarray, level: float, origin: np.ndarray, spacing: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Extract the piece of an isosurface with the largest volume, wound outward, without cavities and islands.

    It is empty if nothing is above the level, as where a slice was blurred.
    """
    points, triangles, _ = isosurface(blurred, level, origin, spacing)
    if not len(triangles):
        return points, triangles
    shell = label_shells(triangles, len(points))
    sizes = np.bincount(shell, signed_volumes(points, triangles))
    largest = triangles[shell == np.argmax(np.abs(sizes))]
    largest = largest if sizes[np.argmax(np.abs(sizes))] > 0 else largest[:, ::-1]
    used, number = np.unique(largest, return_inverse=True)
    return points[used], number.reshape(-1, 3)


# ratio of vertices to those asked for up to which a surface is accepted
MAX_EXCESS = 1.2


def coarse_shell(mask: np.ndarray, grid: Grid, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Build a surface of about ``nodes`` points on the mask's surface; InputError if they are too few for its shape."""
    points, triangles = coarse_surface(mask, grid, nodes)
    if len(points) > MAX_EXCESS * nodes:
        raise InputError(f"{_too_few(grid, nodes)} (without folds and closed gaps it needs {len(points)}).")
    return points, triangles


def fill(
    points: np.ndarray,
    triangles: np.ndarray,
    grid: Grid,
    nodes: int,
    spacing: float = 1.0,
    thin_wall: bool = False,
    balls: Sequence[Ball] = (),
) -> TetMesh:
    """Fill a coarse surface with tetrahedra; InputError if it intersects itself where the body is thin.

    spacing : edge length inside, relative to the surface's mean edge; balls : where elements are smaller
    """
    spacing_m = spacing * mean_edge(points, triangles)
    try:
        return tetrahedralize(points, triangles, spacing_m, source=grid.source, balls=balls)
    except InputError as error:
        remedy = ", or close its hollow in the file" if thin_wall else ""
        raise InputError(f"{_too_few(grid, nodes)}, since it intersects itself where it is thin{remedy}.") from error


def _too_few(grid: Grid, nodes: int) -> str:
    return f"{grid.source}: {nodes} surface nodes are too few for this organ; give more surface_nodes"
