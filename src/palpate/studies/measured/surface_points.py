"""Points of a deformed surface as fixed sums of its nodes, for linear and quadratic elements."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Mesh
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, closest_points
from palpate.effects.surface_integrals import ball_points, surface_interpolation


def nearest_points(mesh: Mesh, points: np.ndarray, order: int) -> sparse.csr_array:
    """Return the map (k, n) from positions of nodes, and for order 2 of edges, to the surface nearest to ``points``.

    points : (k, 3) [m], at rest
    """
    corners = mesh.nodes[mesh.triangles]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    chosen, weights = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
    for i, point in enumerate(points):
        away = np.linalg.norm(middles - point, axis=1)
        near = np.flatnonzero(away - reach <= (away + reach).min())
        x = np.vstack([point, corners[near].reshape(-1, 3)])
        stencils = np.column_stack([np.zeros(len(near), dtype=np.int64), 1 + np.arange(3 * len(near)).reshape(-1, 3)])
        distance, found, _ = closest_points(np.full(len(near), POINT_TRIANGLE), stencils, x)
        best = int(np.argmin(distance))
        chosen[i], weights[i] = near[best], -found[best, 1:]
    return surface_interpolation(mesh, chosen, weights, order)


def disc_points(mesh: Mesh, center: np.ndarray, radius: float, order: int) -> tuple[sparse.csr_array, np.ndarray]:
    """Choose points of the surface in the ball of ``radius`` [m] around ``center``: their map (k, n) and weights (k,).

    The weights [m²] integrate polynomials of degree 4 over that part of the surface; single ones may be negative.
    """
    corners = mesh.nodes[mesh.triangles]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1) + radius
    touched = np.flatnonzero(np.linalg.norm(middles - center, axis=1) < reach)
    barycentric, weights, _ = ball_points(corners[touched], center, radius, 4)
    used = weights != 0.0
    return surface_interpolation(mesh, np.repeat(touched, used.sum(axis=1)), barycentric[used], order), weights[used]


def off_surface(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Compute how far ``points`` (k, 3) [m] are from the surface of ``mesh`` at rest, (k,) [m]."""
    return np.linalg.norm(nearest_points(mesh, points, 1) @ mesh.nodes - points, axis=1)
