"""Uniform 1:8 refinement that keeps the coarse nodes first, and ten-node tetrahedra on the same nodes."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES, Mesh, TetMesh

if TYPE_CHECKING:
    from palpate.bodies.body import Body

# The four corner elements, and for each inner diagonal the four that share it. Numbers 0–3 are corners,
# 4–9 the midpoints of EDGES. All are positively oriented if the parent is.
_CORNERS = [[0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]]
_DIAGONALS = [(4, 9), (5, 8), (6, 7)]
_AROUND = [
    [[4, 9, 7, 5], [4, 9, 8, 7], [4, 9, 6, 8], [4, 9, 5, 6]],
    [[5, 8, 6, 4], [5, 8, 9, 6], [5, 8, 7, 9], [5, 8, 4, 7]],
    [[6, 7, 4, 5], [6, 7, 5, 9], [6, 7, 9, 8], [6, 7, 8, 4]],
]


Snap = Callable[[TetMesh, int], TetMesh]
"""Moves the new nodes of a finer mesh, from the given number on, onto a surface; it returns another mesh."""


def refine(mesh: Mesh) -> tuple[TetMesh, sparse.csr_array]:
    """Split each tetrahedron into eight (Bey 1995), cutting the octahedron along its shortest diagonal.

    Returns the finer mesh, whose first nodes are those of ``mesh`` and whose others are edge midpoints in
    lexicographic edge order, and the prolongation, (n_fine, n_coarse): linear interpolation of nodal values.
    """
    edges, ten = mesh.edges, ten_nodes(mesh)
    nodes = np.vstack([mesh.nodes, mesh.nodes[edges].mean(axis=1)])

    starts, ends = np.transpose(_DIAGONALS)
    lengths = np.linalg.norm(nodes[ten[:, starts]] - nodes[ten[:, ends]], axis=2)
    # a relative margin keeps ties (regular meshes) from being decided by rounding
    shortest = np.argmax(lengths <= lengths.min(axis=1, keepdims=True) * (1 + 1e-9), axis=1)
    children = np.concatenate([np.broadcast_to(_CORNERS, (len(ten), 4, 4)), np.array(_AROUND)[shortest]], axis=1)
    tetrahedra = np.take_along_axis(ten, children.reshape(len(ten), -1), axis=1).reshape(-1, 4)

    return TetMesh(nodes, tetrahedra), halfway(len(mesh.nodes), edges)


def halfway(n: int, ends: np.ndarray) -> sparse.csr_array:
    """Return the linear interpolation (n + m, n) from ``n`` nodes to themselves and the middles of ``ends`` (m, 2)."""
    m = len(ends)
    rows = np.concatenate([np.arange(n), n + np.repeat(np.arange(m), 2)])
    columns = np.concatenate([np.arange(n), ends.ravel()])
    values = np.concatenate([np.ones(n), np.full(2 * m, 0.5)])
    return sparse.csr_array((values, (rows, columns)), shape=(n + m, n))


def finer(body: "Body", count: int = 1, snap: Snap | None = None) -> "Body":
    """Return ``body`` with ``count`` more levels: of the shape that its finest level has, or on its smooth surface.

    snap : for a body without a smooth surface
    Trap: without it, new nodes are midpoints on bodies whose levels were moved to the surface of a file or a CT, too.
    """
    for _ in range(count):
        mesh, prolongation = refine(body.fine)
        move = snap if body.smooth is None else body.smooth.snap
        if move is not None:
            mesh = move(mesh, len(body.fine.nodes))
        held = midpoints_between(body.anchors[-1], prolongation)
        body = replace(
            body,
            levels=[*body.levels, mesh],
            prolongations=[*body.prolongations, prolongation],
            anchors=[*body.anchors, held],
            densities=None if body.densities is None else [*body.densities, prolongation @ body.densities[-1]],
        )
    return body


def coarse_triangles(weights: sparse.csr_array, triangles: np.ndarray) -> np.ndarray:
    """Return the coarse triangles (m, 3), by their nodes, that ``triangles`` (m, 3) of finer nodes are parts of.

    weights : (n_finer, n_coarse), the linear interpolation from the coarse nodes
    """
    rows = np.repeat(np.arange(len(triangles)), 3)
    means = sparse.csr_array((np.ones(triangles.size), (rows, triangles.ravel())), (len(triangles), weights.shape[0]))
    corners = (means @ weights).tocsr()
    corners.sort_indices()
    return corners.indices.reshape(-1, 3)


def with_midpoints(body: "Body", level: int) -> "Body":
    """Return ``body`` with levels up to the one after ``level``, which are the nodes of quadratic elements on it.

    A level after ``level`` that the body lacks is not moved to its smooth surface: sides of elements are straight.
    """
    body = finer(body, level + 1 - len(body.levels))
    return finer(replace(body, smooth=None)) if level + 1 == len(body.levels) else body


def midpoints_between(nodes: np.ndarray, prolongation: sparse.csr_array) -> np.ndarray:
    """Return ``nodes`` (k,) of a level and the finer one's nodes between two of them, increasing."""
    indicator = np.zeros(prolongation.shape[1])
    indicator[nodes] = 1.0
    return np.flatnonzero(prolongation @ indicator == 1.0)


_NEAR, _FAR = 0.5854101966249685, 0.1381966011250105
QUADRATURE_POINTS = np.where(np.eye(4) == 1.0, _NEAR, _FAR)
"""Barycentric coordinates (4, 4) of four points of equal weight, which integrate polynomials of degree 2 exactly."""


def ten_nodes(mesh: Mesh) -> np.ndarray:
    """Return the nodes (n_elements, 10) of quadratic elements on ``mesh``, in the numbering of ``refine(mesh)``.

    The corners come first, then the midpoints of EDGES. So quadratic elements on one level of a body have the nodes of
    linear ones on the next level.
    """
    return np.hstack([mesh.tetrahedra, edge_midpoints(mesh, mesh.tetrahedra[:, EDGES])])


def edge_midpoints(mesh: Mesh, edges: np.ndarray) -> np.ndarray:
    """Return the numbers (m, k) that the midpoints of ``edges`` (m, k, 2) of ``mesh`` have in ``refine(mesh)``."""
    n, ends = len(mesh.nodes), np.sort(edges, axis=2)
    return n + np.searchsorted(mesh.edges[:, 0] * n + mesh.edges[:, 1], ends[..., 0] * n + ends[..., 1])


def shape_functions(points: np.ndarray, edges: np.ndarray = EDGES) -> np.ndarray:
    """Return the values (…, 10) of the quadratic shape functions at barycentric coordinates ``points`` (…, 4).

    edges : of a tetrahedron, or those of a triangle with (…, 3) coordinates, which has (…, 6) functions
    On a face, where the coordinate of the opposite corner is 0, only the functions of the face's six nodes differ
    from 0.
    """
    a, b = points[..., edges[:, 0]], points[..., edges[:, 1]]
    return np.concatenate([points * (2.0 * points - 1.0), 4.0 * a * b], axis=-1)


def quadratic_gradients(points: np.ndarray, edges: np.ndarray = EDGES) -> np.ndarray:
    """Return the derivatives (k, 10, 4) of ``shape_functions`` by the barycentric coordinates; (k, 6, 3) in triangles.

    points : (k, 4) or (k, 3); edges : as of ``shape_functions``
    """
    count, corners = points.shape
    gradients = np.zeros((count, corners + len(edges), corners))
    for corner in range(corners):
        gradients[:, corner, corner] = 4.0 * points[:, corner] - 1.0
    for edge, (a, b) in enumerate(edges, start=corners):
        gradients[:, edge, a], gradients[:, edge, b] = 4.0 * points[:, b], 4.0 * points[:, a]
    return gradients


def quadratic_prolongation(coarse: Mesh, fine: Mesh) -> sparse.csr_array:
    """Return the quadratic interpolation (n_finer, n_fine) from elements on ``coarse`` to those on ``fine``.

    fine : the refinement of ``coarse``, whose n_fine nodes are the unknowns on ``coarse``; n_finer is the number of its
        nodes and edges
    """
    n, fine_ten, coarse_ten = len(fine.nodes), ten_nodes(fine), ten_nodes(coarse)
    parents = np.repeat(np.arange(len(coarse.tetrahedra)), 8)
    place_in_parent = np.argmax(coarse_ten[parents][:, None, :] == fine.tetrahedra[:, :, None], axis=2)
    # of the fine elements' corners, (m, 4, 4): barycentric coordinates in their parents
    corners = np.vstack([np.eye(4), np.eye(4)[EDGES].mean(axis=1)])[place_in_parent]
    nodes, first_entry = np.unique(fine_ten[:, 4:], return_index=True)
    middles = corners[:, EDGES].mean(axis=2).reshape(-1, 4)[first_entry]
    values = shape_functions(middles)  # halves and quarters: zeros are exact
    columns = coarse_ten[parents[first_entry // 6]]
    nonzero = values != 0.0
    rows = np.concatenate([np.arange(n), np.broadcast_to(nodes[:, None], values.shape)[nonzero]])
    columns = np.concatenate([np.arange(n), columns[nonzero]])
    entries = np.concatenate([np.ones(n), values[nonzero]])
    return sparse.csr_array((entries, (rows, columns)), shape=(n + len(nodes), n))
