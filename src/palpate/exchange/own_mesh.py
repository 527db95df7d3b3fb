"""Bring displacements of a mesh of an engine's own to the asked points, and measure what that costs."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Sheet
from palpate.effects.patch_load import nearest_on_surface


class OwnMesh:
    """The surface of an engine's own mesh beside the asked points and the triangles between these.

    ``far_m`` is the largest distance of an asked point from it; ``used`` are its nodes on ``triangles`` between these.
    """

    def __init__(self, nodes: np.ndarray, triangles: np.ndarray, points: np.ndarray, between: np.ndarray):
        self._down, away = _onto(nodes, triangles, points)
        self.used, corners = np.unique(triangles, return_inverse=True)
        self.triangles, used = corners.reshape(triangles.shape), self.used
        self._up, _ = _onto(points, between, nodes[used])
        place = sparse.csr_array((np.ones(len(used)), (used, np.arange(len(used)))), shape=(len(nodes), len(used)))
        self._there_and_back = (self._down @ (place @ self._up)).tocsr()
        self.far_m = float(away.max())

    def at_points(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacements (…, p, 3) [m] at the asked points of those (…, n, 3) [m] of the mesh's nodes."""
        return _each(self._down, displacement)

    def at_nodes(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacements (…, u, 3) [m] at the used nodes of those (…, p, 3) [m] at the asked points."""
        return _each(self._up, displacement)

    def through(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacements (…, p, 3) [m] of the asked points after they were taken at the mesh's nodes only."""
        return _each(self._there_and_back, displacement)


def _each(matrix: sparse.csr_array, displacement: np.ndarray) -> np.ndarray:
    return np.array([matrix @ each for each in displacement.reshape(-1, *displacement.shape[-2:])]).reshape(
        *displacement.shape[:-2], -1, 3
    )


def _onto(nodes: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> tuple[sparse.csr_array, np.ndarray]:
    """Return the linear interpolation (p, n) to what of a surface is nearest to ``points``, and distances (p,) [m]."""
    corners, weights, away = nearest_on_surface(Sheet(nodes, triangles, 0.0), points)
    rows = np.repeat(np.arange(len(points)), 3)
    return sparse.csr_array((weights.ravel(), (rows, corners.ravel())), shape=(len(points), len(nodes))), away
