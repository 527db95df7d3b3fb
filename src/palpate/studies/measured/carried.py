"""Markers that stand off a surface and move rigidly with the patch that they are glued to."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Mesh
from palpate.linalg.polar import rotations
from palpate.studies.measured.surface_points import disc_points, nearest_points

LEAST = 0.02
"""Least radius of a marker's patch, as a share of the body's size: for markers that are on the surface itself."""


class Carried:
    """Markers at ``places`` (m, 3) [m] at rest, on linear or, of ``order`` 2, quadratic elements on ``mesh``.

    Each is carried by the rigid motion that fits the deformed patch best: the surface as far around the point nearest
    to the marker as the marker stands off. Trap: carried by the displacement of the nearest point alone, a marker that
    stands 6 mm off a bending beam of 100 mm misses a third of its motion along the beam.
    """

    def __init__(self, mesh: Mesh, places: np.ndarray, order: int):
        rest = mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])
        self._places = np.asarray(places, dtype=float)
        self._patches = [self._patch(mesh, rest, place, order) for place in self._places]

    @staticmethod
    def _patch(mesh: Mesh, rest: np.ndarray, place: np.ndarray, order: int) -> tuple:
        """Return the map to the patch's points, their shares (k,), places (k, 3) seen from their mean, and that."""
        foot = (nearest_points(mesh, place[None], order) @ rest)[0]
        radius = max(float(np.linalg.norm(place - foot)), LEAST * mesh.size)
        up, weights = disc_points(mesh, foot, radius, order)
        shares, points = weights / weights.sum(), up @ rest
        middle = shares @ points
        return up, shares, points - middle, middle

    def of(self, x: np.ndarray) -> np.ndarray:
        """Return the markers' places (m, 3) [m] where the nodes are at ``x`` (n, 3) [m]."""
        found = np.empty_like(self._places)
        for i, (up, shares, away, middle) in enumerate(self._patches):
            points = _points(up, x)
            now = shares @ points
            turn = rotations(((points - now).T @ (shares[:, None] * away))[None])[0]
            found[i] = now + turn @ (self._places[i] - middle)
        return found


def _points(up: sparse.csr_array, x: np.ndarray) -> np.ndarray:
    return up @ x
