"""Conversion of pairs of triangles to the pairs of points, edges and triangles that can touch, each once."""

import numba
import numpy as np

from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE
from palpate.errors import InputError


class Surface:
    """Triangles, each vertex and each edge of which is owned by one of them (Curtis, Tamstorf and Manocha 2008).

    nodes : (m, 3) int64, the triangles
    vertices, edges : (m, 3) bool, whether a triangle owns its i-th vertex, its edge from the i-th to the next
    A triangle (p, p, p) is a point and has one vertex, (p, q, q) is a segment and has two vertices and one edge.
    Raises InputError if ``triangles`` are not (m, 3) integers ≥ 0.
    """

    def __init__(self, triangles: np.ndarray):
        triangles = np.asarray(triangles)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
            raise InputError(f"triangles have shape {triangles.shape}; give integers of shape (m, 3).")
        if triangles.size and triangles.min() < 0:
            raise InputError("triangles name nodes below 0; number them from 0.")
        self.nodes = np.ascontiguousarray(triangles, dtype=np.int64)
        self.vertices = _first_occurrences(self.nodes.ravel()).reshape(-1, 3)
        after = np.roll(self.nodes, -1, axis=1)
        low, high = np.minimum(self.nodes, after), np.maximum(self.nodes, after)
        owned = _first_occurrences((low * (high.max(initial=0) + 1) + high).ravel()).reshape(-1, 3)
        self.edges = owned & (low != high)


def stencils(first: Surface, second: Surface, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """List kinds (k,) and nodes (k, 4) of the stencils of ``pairs`` (p, 2) of triangles of two surfaces, or of one.

    Each vertex with each triangle, either way, and each edge with each edge, through the triangles that own them;
    none that share a node. A triangle that is a point touches only another's points: others have it as their vertex.
    Trap: within one surface, parts that a triangle owns can come near an adjacent triangle, so ``pairs`` must include
    ``adjacent_pairs``, which trees leave out.
    """
    pairs = np.ascontiguousarray(pairs, dtype=np.int64).reshape(-1, 2)
    return _stencils(first.nodes, first.vertices, first.edges, second.nodes, second.vertices, second.edges, pairs)


def adjacent_pairs(triangles: np.ndarray) -> np.ndarray:
    """List pairs i < j (p, 2) of ``triangles`` (m, 3) that share a node but are not one triangle twice, sorted."""
    order = np.argsort(triangles, axis=None, kind="stable")
    starts = np.flatnonzero(np.diff(triangles.ravel()[order], prepend=-1, append=-1))
    pairs = _pairs_within(order // 3, starts)
    return np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)


def _first_occurrences(keys):
    """Mark the entries of ``keys`` (n,) that are the first of their value."""
    owned = np.zeros(len(keys), dtype=bool)
    owned[np.unique(keys, return_index=True)[1]] = True
    return owned


@numba.njit(cache=True)
def _pairs_within(members, starts):
    """List all ordered pairs (p, 2) of ``members`` from one start to the next."""
    count = 0
    for g in range(len(starts) - 1):
        count += (starts[g + 1] - starts[g]) ** 2
    pairs, count = np.empty((count, 2), np.int64), 0
    for g in range(len(starts) - 1):
        for i in range(starts[g], starts[g + 1]):
            for j in range(starts[g], starts[g + 1]):
                pairs[count, 0], pairs[count, 1] = members[i], members[j]
                count += 1
    return pairs


@numba.njit(cache=True)
def _stencils(nodes_a, vertices_a, edges_a, nodes_b, vertices_b, edges_b, pairs):
    # a pair has at most 3 + 3 points with a triangle and 9 pairs of edges; the actual ones are counted first
    count, kinds, nodes = 0, np.empty(0, np.int64), np.empty((0, 4), np.int64)
    for fill in (False, True):
        if fill:
            kinds, nodes, count = np.empty(count, np.int64), np.empty((count, 4), np.int64), 0
        for k in range(len(pairs)):
            i, j = pairs[k]
            count = _points(nodes_a[i], vertices_a[i], nodes_b[j], False, fill, count, kinds, nodes)
            count = _points(nodes_b[j], vertices_b[j], nodes_a[i], True, fill, count, kinds, nodes)
            count = _edges(nodes_a[i], edges_a[i], nodes_b[j], edges_b[j], fill, count, kinds, nodes)
    return kinds, nodes


@numba.njit(cache=True)
def _points(triangle, owned, other, swapped, fill, count, kinds, nodes):
    """Write the owned vertices of ``triangle`` with the triangle ``other``; return the new count of stencils."""
    if other[0] == other[1] == other[2] and (swapped or not triangle[0] == triangle[1] == triangle[2]):
        return count
    for i in range(3):
        p = triangle[i]
        if owned[i] and p != other[0] and p != other[1] and p != other[2]:
            if fill:
                kinds[count], nodes[count, 0] = POINT_TRIANGLE, p
                nodes[count, 1:] = other
            count += 1
    return count


@numba.njit(cache=True)
def _edges(triangle, owned, other, owned_other, fill, count, kinds, nodes):
    """Write the owned edges of two triangles that share no node; return the new count of stencils."""
    for i in range(3):
        a, b = triangle[i], triangle[(i + 1) % 3]
        for j in range(3):
            c, d = other[j], other[(j + 1) % 3]
            if owned[i] and owned_other[j] and a != c and a != d and b != c and b != d:
                if fill:
                    kinds[count] = EDGE_EDGE
                    nodes[count, 0], nodes[count, 1], nodes[count, 2], nodes[count, 3] = a, b, c, d
                count += 1
    return count
