"""Basic operations on triangulated surfaces: normals, volume, welding of points, exchange with VTK."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import area_normals, components

# points closer than this fraction of the size are merged: an STL file repeats each corner, in single precision
WELD = 1e-6


def weld(points: np.ndarray, triangles: np.ndarray, fraction: float = WELD) -> tuple[np.ndarray, np.ndarray]:
    """Merge points closer than a fraction of the size; drop the triangles that this degenerates, and unused points."""
    tolerance = fraction * np.ptp(points, axis=0).max()
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    group = components(pairs, len(points))
    first_of_group = np.unique(group, return_index=True)[1]
    triangles = first_of_group[group][triangles]
    a, b, c = triangles.T
    return drop_unused(points, triangles[(a != b) & (b != c) & (c != a)])


def drop_unused(points: np.ndarray, elements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop the points that no element uses, and number the others anew in their order."""
    used = np.unique(elements)
    return np.ascontiguousarray(points[used]), np.searchsorted(used, elements)


def inflate(points: np.ndarray, triangles: np.ndarray, volume_m3: float) -> np.ndarray:
    """Move all points along their normals by one common distance such that the surface has the given volume.

    A coarse polyhedron with its corners on a mostly convex surface is too small by some per cent.
    """
    for _ in range(20):
        normals = vertex_normals(points, triangles)
        missing_m3 = volume_m3 - volume(points, triangles)
        if abs(missing_m3) <= 1e-12 * volume_m3:
            break
        # the rate at which the volume grows with the distance
        at_corners = sum(normals[triangles[:, i]] for i in range(3))
        rate = np.einsum("tj,tj->", area_normals(points, triangles), at_corners) / 6
        points = points + missing_m3 / rate * normals
    return points


def mean_edge(points: np.ndarray, triangles: np.ndarray) -> float:
    """Compute the mean length [m] of the triangles' edges."""
    edges = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    return float(np.linalg.norm(edges, axis=2).mean())


def part_centres(parts: int) -> np.ndarray:
    """Return the centres of parts² equal parts of a triangle, (parts², 2), as shares of two sides from their corner."""
    u, v = (x.ravel() for x in np.meshgrid(np.arange(parts), np.arange(parts)))
    upright, inverted = u + v < parts, u + v < parts - 1
    return np.column_stack([np.append(each[upright] + 1 / 3, each[inverted] + 2 / 3) for each in (u, v)]) / parts


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Compute the volume [m³] inside a closed surface wound outward; 0 of an empty one."""
    return float(signed_volumes(points, triangles).sum() / 6)


def signed_volumes(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute six times the signed volume between each triangle and the mean of the points, (m,)."""
    middle = points.sum(axis=0) / max(len(points), 1)
    a, b, c = (points[triangles[:, i]] - middle for i in range(3))
    return np.einsum("ij,ij->i", np.cross(a, b), c)


def polydata(points: np.ndarray, triangles: np.ndarray) -> Any:
    """Put points (n, 3) and triangles (m, 3) into a pyvista.PolyData, in double precision."""
    import pyvista

    return pyvista.PolyData.from_regular_faces(np.ascontiguousarray(points, dtype=float), triangles)


def distances(places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute the distances of places, (k, 3), from a surface, (k,)."""
    import pyvista

    signed = pyvista.PolyData(places).compute_implicit_distance(polydata(points, triangles))
    return np.abs(signed["implicit_distance"])


def image_data(samples: np.ndarray, origin: np.ndarray, spacing: np.ndarray) -> Any:
    """Put samples (nz, ny, nx) on a grid, by its first place and its spacing (3,) [m], into a pyvista.ImageData."""
    import pyvista

    grid = pyvista.ImageData(dimensions=samples.shape[::-1], spacing=spacing.tolist(), origin=origin.tolist())
    grid.point_data.set_array(samples.ravel(), "samples")
    grid.set_active_scalars("samples")
    return grid


def arrays(surface: Any) -> tuple[np.ndarray, np.ndarray]:
    """Copy points (n, 3) and triangles (m, 3) out of a pyvista.PolyData without other polygons."""
    return np.array(surface.points, dtype=float), surface.regular_faces.reshape(-1, 3).astype(np.int64)


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute unit normals, weighted by area, (n, 3)."""
    areas = area_normals(points, triangles)
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(v, 3), len(points)) for v in areas.T], axis=1)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)
