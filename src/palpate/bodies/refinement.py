"""Uniform 1:8 refinement that keeps the coarse nodes first, and its prolongation."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import EDGES, Mesh, TetMesh

if TYPE_CHECKING:  # bodies are nested by this module
    from palpate.bodies.body import Body

# The four corner elements, and for each inner diagonal the four that share it. Numbers 0–3 are corners,
# 4–9 the midpoints of EDGES. All are positively oriented if the parent is.
_CORNERS = [[0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]]
_DIAGONALS = [(4, 9), (5, 8), (6, 7)]
_AROUND = [[5, 7, 8, 6], [4, 6, 9, 7], [4, 5, 9, 8]]


def refine(mesh: Mesh) -> tuple[TetMesh, sparse.csr_array]:
    """Split each tetrahedron into eight (Bey 1995), cutting the octahedron along its shortest diagonal.

    Returns the finer mesh, whose first nodes are those of ``mesh`` and whose others are edge midpoints in
    lexicographic edge order, and the prolongation, (n_fine, n_coarse): linear interpolation of nodal values.
    """
    n = len(mesh.nodes)
    ends = mesh.edges
    nodes = np.vstack([mesh.nodes, mesh.nodes[ends].mean(axis=1)])
    keys = ends[:, 0] * n + ends[:, 1]
    local = np.sort(mesh.tetrahedra[:, EDGES], axis=2)
    midpoints = n + np.searchsorted(keys, local[..., 0] * n + local[..., 1])
    ten = np.hstack([mesh.tetrahedra, midpoints])

    p, q = np.transpose(_DIAGONALS)
    lengths = np.linalg.norm(nodes[ten[:, p]] - nodes[ten[:, q]], axis=2)
    # a relative margin keeps ties (regular meshes) from being decided by rounding
    choice = np.argmax(lengths <= lengths.min(axis=1, keepdims=True) * (1 + 1e-9), axis=1)
    inner = np.array([_octahedron(d) for d in range(3)])
    children = np.concatenate([np.broadcast_to(_CORNERS, (len(ten), 4, 4)), inner[choice]], axis=1).reshape(
        len(ten), -1
    )
    tetrahedra = np.take_along_axis(ten, children, axis=1).reshape(-1, 4)

    m = len(ends)
    rows = np.concatenate([np.arange(n), n + np.repeat(np.arange(m), 2)])
    columns = np.concatenate([np.arange(n), ends.ravel()])
    values = np.concatenate([np.ones(n), np.full(2 * m, 0.5)])
    return TetMesh(nodes, tetrahedra), sparse.csr_array((values, (rows, columns)), shape=(n + m, n))


def finer(body: "Body", count: int = 1) -> "Body":
    """Return ``body`` with ``count`` more levels: of the shape that its finest level has, or on its smooth surface.

    Trap: new nodes are midpoints on bodies whose levels were moved to the dense surface of a file or a CT, too.
    """
    for _ in range(count):
        mesh, prolongation = refine(body.fine)
        if body.smooth is not None:
            mesh = body.smooth.snap(mesh, len(body.fine.nodes))
        held = midpoints_between(body.anchors[-1], prolongation)
        body = replace(
            body,
            levels=[*body.levels, mesh],
            prolongations=[*body.prolongations, prolongation],
            anchors=[*body.anchors, held],
            densities=None if body.densities is None else [*body.densities, prolongation @ body.densities[-1]],
        )
    return body


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


def _octahedron(diagonal: int) -> list[list[int]]:
    """List the four elements around one diagonal, oriented as the reference tetrahedron is."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    points = np.vstack([corners, corners[EDGES].mean(axis=1)])
    p, q = _DIAGONALS[diagonal]
    ring = _AROUND[diagonal]
    elements = []
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        element = [p, q, a, b]
        edges = points[element[1:]] - points[element[0]]
        elements.append(element if np.linalg.det(edges) > 0 else [p, q, b, a])
    return elements
