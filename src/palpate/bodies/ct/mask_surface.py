"""The closed surface of a mask: dense and smooth as the CT has it, or of a wanted number of nodes."""

import numpy as np
from scipy.ndimage import gaussian_filter, zoom

from palpate.bodies.ct.image import Image
from palpate.bodies.surfaces.remesh import across, remesh, vertex_normals
from palpate.bodies.surfaces.tetrahedralize import shells
from palpate.errors import InputError

# blur of the mask and step between the samples that a remeshing starts from, as parts of the wanted edge
BLUR, STEP = 0.2, 0.25
MOST_SAMPLES = 4e8  # of them: 1.6 GB
# parts of the volume that may be in other pieces of the smoothed mask, and missing from a coarse sample of it
LOST, LOST_COARSE = 0.02, 0.1

# where the search for the level that keeps the volume begins, how often it tries and when it is content
LEVELS, SECANTS, CLOSE = (0.45, 0.5), 8, 1e-4


def surface(mask: np.ndarray, image: Image, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (nodes, 3) [m] and triangles wound outward, with the volume of the mask's voxels."""
    points, triangles = coarse_surface(mask, image, nodes)
    return inflate(points, triangles, mask.sum() * image.voxel_m3), triangles


def coarse_surface(mask: np.ndarray, image: Image, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """The same, but with its points on the mask's surface, so that it is too small by some percent.

    What is thinner than a part of an edge cannot be shown by so few nodes, and is blurred away first.
    """
    area = np.linalg.norm(across(*dense_surface(mask, image)), axis=1).sum() / 2
    edge = float(np.sqrt(2 * area / (3**0.5 * nodes)))
    soft, origin, spacing = _softened(mask, image, BLUR * edge)
    whole = mask.sum() * image.voxel_m3
    level, dense = _cut(soft, origin, spacing, whole)
    samples = np.prod(np.array(soft.shape) * spacing[::-1] / (STEP * edge))
    if samples > MOST_SAMPLES:
        raise InputError(
            f"{image.source}: surface_nodes is {nodes}, which are too many for this organ: their triangles would be "
            f"{1e3 * edge:.2g} mm wide and the voxels are {1e3 * spacing.min():.2g} mm; give fewer surface_nodes."
        )
    even = zoom(soft, spacing[::-1] / (STEP * edge), order=1, grid_mode=False)
    stretched = spacing * (np.array(soft.shape[::-1]) - 1) / (np.array(even.shape[::-1]) - 1)
    start = _contour(even, level, origin, stretched)
    if volume(*dense) < (1 - LOST) * whole or volume(*start) < (1 - LOST_COARSE) * whole:
        raise InputError(
            f"{image.source}: {nodes} surface nodes are too few for this organ, parts of which they cannot reach; "
            "give more surface_nodes."
        )
    return remesh(*start, *dense, nodes)


def dense_surface(mask: np.ndarray, image: Image) -> tuple[np.ndarray, np.ndarray]:
    """The mask's smooth surface: (n, 3) [m] and (m, 3), of one piece, without hollows, wound outward."""
    whole = mask.sum() * image.voxel_m3
    points, triangles = _cut(*_softened(mask, image, 0.0), whole)[1]
    if volume(points, triangles) < (1 - LOST) * whole:
        raise InputError(
            f"{image.source}: the organ is too thin for its slices, and falls apart when they are smoothed; "
            "give thinner slices or another mask."
        )
    return points, triangles


def _softened(mask: np.ndarray, image: Image, blur_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mask (z, y, x), blurred so that no step between slices stays, its origin and its spacing [m]."""
    spacing = image.spacing_m[::-1]
    blur = max(blur_m, image.spacing_m.max()) / spacing
    margin = np.ceil(4 * blur).astype(int) + 1
    places = np.argwhere(mask)
    low, high = places.min(axis=0), places.max(axis=0) + 1
    box = mask[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    soft = gaussian_filter(np.pad(box, margin[:, None]).astype(np.float32), blur)
    return soft, image.to_world(low - margin), image.spacing_m


def _cut(soft: np.ndarray, origin, spacing, volume_m3: float) -> tuple[float, tuple[np.ndarray, np.ndarray]]:
    """The level at which the surface has the volume wanted, and that surface: blurring then takes no volume.

    By the secant rule, as the volume is almost linear in the level. Where pieces fall off it is not, and what it
    ends with may lack them.
    """
    other, level = LEVELS
    lacking = volume(*_contour(soft, other, origin, spacing)) - volume_m3
    for _ in range(SECANTS):
        found = level, _contour(soft, level, origin, spacing)
        missing = volume(*found[1]) - volume_m3
        if abs(missing) <= CLOSE * volume_m3 or missing == lacking:
            break
        step = missing * (level - other) / (missing - lacking)
        other, lacking = level, missing
        level = float(np.clip(level - step, 0.1, 0.9))
    return found


def _contour(soft: np.ndarray, level: float, origin, spacing) -> tuple[np.ndarray, np.ndarray]:
    """The largest piece of an isosurface, by flying edges (Schroeder, Maynard, Geveci 2015): marching cubes, faster.

    Without a point if nothing is above the level, as where one slice was blurred away.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    grid, edges = vtkImageData(), vtkFlyingEdges3D()
    grid.SetDimensions(soft.shape[::-1])
    grid.SetSpacing(spacing)
    grid.SetOrigin(origin)
    grid.GetPointData().SetScalars(numpy_to_vtk(soft.ravel(), deep=True))
    edges.SetInputData(grid)
    edges.SetValue(0, level)
    edges.ComputeNormalsOff()
    edges.Update()
    found = edges.GetOutput()
    if not found.GetNumberOfPolys():
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return _largest(vtk_to_numpy(found.GetPoints().GetData()).astype(float), triangles.astype(np.int64))


def inflate(points: np.ndarray, triangles: np.ndarray, volume_m3: float) -> np.ndarray:
    """Move all points along their normals by one distance that gives the volume wanted.

    A coarse polyhedron with its corners on a mostly convex surface is too small by some percent.
    """
    for _ in range(20):
        normals = vertex_normals(points, triangles)
        missing = volume_m3 - volume(points, triangles)
        if abs(missing) <= 1e-12 * volume_m3:
            break
        # the rate at which the volume grows with the distance
        rate = np.einsum("tj,tj->", across(points, triangles), sum(normals[triangles[:, i]] for i in range(3))) / 6
        points = points + missing / rate * normals
    return points


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """The volume [m³] inside a closed surface wound outward; 0 of an empty one."""
    return float(_wedges(points, triangles).sum() / 6)


def _wedges(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Six times the volume between each triangle and the middle of the points, (m,), negative if seen from inside."""
    middle = points.sum(axis=0) / max(len(points), 1)
    a, b, c = (points[triangles[:, i]] - middle for i in range(3))
    return np.einsum("ij,ij->i", np.cross(a, b), c)


def _largest(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The piece of the surface with the largest volume, wound outward; hollows and islands go."""
    piece = shells(triangles, len(points))
    sizes = np.bincount(piece, _wedges(points, triangles))
    kept = triangles[piece == np.argmax(np.abs(sizes))]
    kept = kept if sizes[np.argmax(np.abs(sizes))] > 0 else kept[:, ::-1]
    used, number = np.unique(kept, return_inverse=True)
    return points[used], number.reshape(-1, 3)
