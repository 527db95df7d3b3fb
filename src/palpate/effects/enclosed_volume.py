"""The volume that the surface of a deformed body encloses, exactly for linear and for quadratic elements."""

import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.effects.ball_integral import EDGES, midpoints

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def enclosed_volume(mesh: Mesh, x: np.ndarray) -> float:
    """Compute the volume [m³] within the surface of ``mesh`` whose nodes are at ``x`` (n, 3) [m].

    With as many rows more as the mesh has ``edges``, the faces are those of quadratic elements. The volume is
    ∮ x · n dA / 3, which for these is a polynomial of degree 4 on each triangle: nine points integrate it exactly.
    """
    corners = mesh.triangles
    if len(x) == len(mesh.nodes):
        return float(np.linalg.det(x[corners]).sum()) / 6.0
    places = x[np.hstack([corners, midpoints(mesh, corners)])]
    volume = 0.0
    for u, by_u in zip(0.5 * (_GAUSS + 1.0), 0.5 * _WEIGHTS, strict=True):
        for v, by_v in zip(0.5 * (_GAUSS + 1.0), 0.5 * _WEIGHTS, strict=True):
            shape, along = _shapes(u, v * (1.0 - u))
            point, first, last = (np.einsum("a,mai->mi", each, places) for each in (shape, *along))
            volume += by_u * by_v * (1.0 - u) * float(np.vdot(point, np.cross(first, last)))
    return volume / 3.0


def _shapes(r: float, s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the quadratic shape functions (6,) of a triangle at (r, s), and their derivatives (2, 6)."""
    at, by = np.array([1.0 - r - s, r, s]), np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    first, last = EDGES.T
    shape = np.concatenate([at * (2.0 * at - 1.0), 4.0 * at[first] * at[last]])
    slopes = 4.0 * (by[:, first] * at[last] + at[first] * by[:, last])
    return shape, np.hstack([by * (4.0 * at - 1.0), slopes])
