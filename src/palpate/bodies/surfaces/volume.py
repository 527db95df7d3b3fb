"""Volume inside a closed surface, and a surface of a given volume."""

import numpy as np

from palpate.bodies.surfaces.decimate import area_normals, vertex_normals


def inflate(points: np.ndarray, triangles: np.ndarray, volume_m3: float) -> np.ndarray:
    """Move all points along their normals by one common distance such that the surface has the given volume.

    A coarse polyhedron with its corners on a mostly convex surface is too small by some per cent.
    """
    for _ in range(20):
        normals = vertex_normals(points, triangles)
        missing = volume_m3 - volume(points, triangles)
        if abs(missing) <= 1e-12 * volume_m3:
            break
        # the rate at which the volume grows with the distance
        rate = (
            np.einsum("tj,tj->", area_normals(points, triangles), sum(normals[triangles[:, i]] for i in range(3))) / 6
        )
        points = points + missing / rate * normals
    return points


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Compute the volume [m³] inside a closed surface wound outward; 0 of an empty one."""
    return float(signed_volumes(points, triangles).sum() / 6)


def signed_volumes(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute six times the signed volume between each triangle and the mean of the points, (m,)."""
    middle = points.sum(axis=0) / max(len(points), 1)
    a, b, c = (points[triangles[:, i]] - middle for i in range(3))
    return np.einsum("ij,ij->i", np.cross(a, b), c)
