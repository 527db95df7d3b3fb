"""Interpolate displacements of a locally refined mesh to the fine surface of the whole body."""

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.refinement import coarse_triangles
from palpate.bodies.surface_quadrature import surface_interpolation

_ROUNDING = 1e-9
"""Coordinates above minus this count as inside; they are multiples of a power of 2, or at least 0.25 outside."""


class FineSurfaceMap:
    """Places of a body's fine surface nodes in its coarse triangles, which every local refinement of it splits further.

    They follow from the prolongation, not from rest positions, which may have moved to a smooth surface.
    """

    def __init__(self, body: Body):
        first_corner = np.unique(body.fine.triangles, return_index=True)[1]
        self._coarse_nodes = len(body.coarse.nodes)
        sides = coarse_triangles(body.prolongation, body.fine.triangles)[first_corner // 3]
        self._keys, self._places = self._key(sides), _coordinates(body.prolongation, body.fine.surface, sides)

    def of(self, local: Body, order: int) -> sparse.csr_array:
        """Return the interpolation (n_surface, n_unknowns) with the shape functions of elements on ``local``.

        Those of ``order`` 2 have the nodes and the edge midpoints of its finest level.
        """
        local_triangles, weights = local.fine.triangles, local.prolongation
        coarse = coarse_triangles(weights, local_triangles)
        keys = self._key(coarse)
        ranked = np.argsort(keys, kind="stable")
        start, stop = (np.searchsorted(keys[ranked], self._keys, side) for side in ("left", "right"))
        # each fine node with all local triangles in its coarse triangle
        node = np.repeat(np.arange(len(self._keys)), stop - start)
        candidate = np.arange(len(node)) - np.repeat(np.cumsum(stop - start) - (stop - start), stop - start)
        triangle = ranked[np.repeat(start, stop - start) + candidate]
        corners = np.stack([_coordinates(weights, local_triangles[:, i], coarse) for i in range(3)], axis=2)
        coordinates = np.linalg.solve(corners[triangle], self._places[node][:, :, None])[:, :, 0]
        inside_rows = np.flatnonzero(coordinates.min(axis=1) > -_ROUNDING)
        chosen = inside_rows[np.unique(node[inside_rows], return_index=True)[1]]
        return surface_interpolation(local.fine, triangle[chosen], coordinates[chosen], order)

    def _key(self, sides: np.ndarray) -> np.ndarray:
        return (sides[:, 0].astype(np.int64) * self._coarse_nodes + sides[:, 1]) * self._coarse_nodes + sides[:, 2]


def _coordinates(weights: sparse.csr_array, nodes: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return the coordinates (m, 3) of finer ``nodes`` (m,) in coarse triangles ``sides`` (m, 3)."""
    return weights[nodes[:, None], sides].toarray()
