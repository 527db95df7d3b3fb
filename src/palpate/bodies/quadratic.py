"""Ten-node tetrahedra with straight sides: their nodes, shape functions, points of integration and prolongation."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES, Mesh

_NEAR, _FAR = 0.5854101966249685, 0.1381966011250105
POINTS = np.where(np.eye(4) == 1.0, _NEAR, _FAR)
"""Barycentric coordinates (4, 4) of four points of equal weight, which integrate polynomials of degree 2 exactly."""


def ten_nodes(mesh: Mesh) -> np.ndarray:
    """Return the nodes (n_elements, 10) of quadratic elements on ``mesh``, in the numbering of ``refine(mesh)``.

    The corners come first, then the midpoints of EDGES. So quadratic elements on one level of a body have the nodes of
    linear ones on the next level.
    """
    n, ends = len(mesh.nodes), mesh.edges
    local = np.sort(mesh.tetrahedra[:, EDGES], axis=2)
    midpoints = n + np.searchsorted(ends[:, 0] * n + ends[:, 1], local[..., 0] * n + local[..., 1])
    return np.hstack([mesh.tetrahedra, midpoints])


def shape_functions(points: np.ndarray) -> np.ndarray:
    """Return the values (k, 10) of the quadratic shape functions at barycentric coordinates ``points`` (k, 4).

    On a face, where the coordinate of the opposite corner is 0, only the functions of the face's six nodes differ
    from 0.
    """
    a, b = points[:, EDGES[:, 0]], points[:, EDGES[:, 1]]
    return np.hstack([points * (2.0 * points - 1.0), 4.0 * a * b])


def shape_slopes(points: np.ndarray) -> np.ndarray:
    """Return the derivatives (k, 10, 4) of the shape functions with respect to the barycentric coordinates."""
    slopes = np.zeros((len(points), 10, 4))
    for corner in range(4):
        slopes[:, corner, corner] = 4.0 * points[:, corner] - 1.0
    for edge, (a, b) in enumerate(EDGES, start=4):
        slopes[:, edge, a], slopes[:, edge, b] = 4.0 * points[:, b], 4.0 * points[:, a]
    return slopes


def prolongation(coarse: Mesh, fine: Mesh) -> sparse.csr_array:
    """Return the quadratic interpolation (n_finer, n_fine) from elements on ``coarse`` to those on ``fine``.

    fine : the refinement of ``coarse``, whose n_fine nodes are the unknowns on ``coarse``; n_finer is the number of its
        nodes and edges
    """
    n, elements, ten = len(fine.nodes), ten_nodes(fine), ten_nodes(coarse)
    parents = np.repeat(np.arange(len(coarse.tetrahedra)), 8)
    places = np.argmax(ten[parents][:, None, :] == fine.tetrahedra[:, :, None], axis=2)
    corners = np.vstack([np.eye(4), np.eye(4)[EDGES].mean(axis=1)])[places]
    nodes, first = np.unique(elements[:, 4:], return_index=True)
    middles = corners[:, EDGES].mean(axis=2).reshape(-1, 4)[first]
    values = shape_functions(middles)  # halves and quarters: zeros are exact
    columns = ten[parents[first // 6]]
    kept = values != 0.0
    rows = np.broadcast_to(nodes[:, None], values.shape)
    identity = np.arange(n)
    return sparse.csr_array(
        (
            np.concatenate([np.ones(n), values[kept]]),
            (np.concatenate([identity, rows[kept]]), np.concatenate([identity, columns[kept]])),
        ),
        shape=(n + len(nodes), n),
    )
