"""Meshes: nodes, elements and their surface."""

from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""The four faces of a tetrahedron, each wound so that its normal points outward."""

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
"""The six edges of a tetrahedron."""


def components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Number the connected pieces of ``count`` nodes that ``pairs`` (k, 2) join, (count,) from 0."""
    graph = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def triangle_edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (k, 2) of ``triangles`` (m, 3), and how many triangles have each, (k,).

    Each edge is there once, smaller node first, in lexicographic order.
    """
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)


def edge_lengths(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the lengths (k,) [m] of ``edges`` (k, 2) between ``points`` (n, 3) [m]."""
    return np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)


def corner_normals(corners: np.ndarray) -> np.ndarray:
    """Return the normals (…, 3) of triangles with ``corners`` (…, 3, 3), as long as twice the triangle's area."""
    return np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])


def area_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the normals (m, 3) of ``triangles`` (m, 3) on ``points`` (n, 3), as long as twice the triangle's area."""
    return corner_normals(points[triangles])


def unit(vector: np.ndarray) -> np.ndarray:
    """Return ``vector`` (3,) or vectors (n, 3) at length 1."""
    vector = np.asarray(vector, dtype=float)
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def winding_number(point: np.ndarray, corners: np.ndarray) -> float:
    """Compute how often triangles (m, 3, 3) [m], wound outward, enclose ``point`` (3,) [m]: 1 inside, 0 outside.

    The sum of their solid angles over 4π (van Oosterom and Strackee 1983). A triangle in whose plane the point lies
    has none, so that it is ½ on a flat side.
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    triple_product = np.einsum("ij,ij->i", a, np.cross(b, c))
    cosines = la * lb * lc + lc * np.sum(a * b, axis=1) + lb * np.sum(a * c, axis=1) + la * np.sum(b * c, axis=1)
    off_plane = np.abs(triple_product) > 1e-9 * la * lb * lc
    return float(np.arctan2(triple_product, cosines)[off_plane].sum() / (2.0 * np.pi))


def within(places: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pair places (k, d) with the simplices (m, d + 1, d) near them, of which some contain them.

    Returns n pairs: the number of the place (n,), that of the simplex (n,), and the place's barycentric coordinates in
    it (n, d + 1), all positive where the simplex contains the place. Flat simplices are left out.
    """
    edges = corners[:, 1:] - corners[:, :1]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    not_flat = np.flatnonzero(np.abs(np.linalg.det(edges)) > 1e-9 * longest ** edges.shape[2])
    middles = corners[not_flat].mean(axis=1)
    reach = np.linalg.norm(corners[not_flat] - middles[:, None], axis=2).max(axis=1)
    near_places = cKDTree(places).query_ball_point(middles, reach) if len(places) and len(not_flat) else []
    simplex = not_flat[np.repeat(np.arange(len(near_places)), [len(each) for each in near_places])]
    place = np.fromiter(chain.from_iterable(near_places), dtype=np.int64)
    from_corner = (places[place] - corners[simplex, 0])[:, :, None]
    inner_coordinates = np.linalg.solve(edges[simplex].transpose(0, 2, 1), from_corner)[:, :, 0]
    return place, simplex, np.column_stack([1.0 - inner_coordinates.sum(axis=1), inner_coordinates])


def ranked_faces(faces: np.ndarray, n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the order (m,) that sorts faces (m, 3) of increasing nodes, and which equal the next one, (m - 1,)."""
    a, b, c = faces.T
    keys = a * n_nodes + b  # numbers sort many times as fast as rows
    order = np.lexsort((c, keys))
    return order, (np.diff(keys[order]) == 0) & (np.diff(c[order]) == 0)


class Around:
    """The elements around each of ``n_nodes`` nodes, by the nodes (m, corners) of all elements.

    elements : those of one node after the other; ends : (n_nodes + 1,) where those of each begin, and the end
    """

    def __init__(self, elements: np.ndarray, n_nodes: int):
        self.elements = np.argsort(elements.ravel(), kind="stable") // elements.shape[1]
        self.ends = np.searchsorted(np.sort(elements.ravel()), np.arange(n_nodes + 1))

    def of(self, node: int) -> np.ndarray:
        """Return the numbers of the elements that have ``node``, increasing."""
        return self.elements[self.ends[node] : self.ends[node + 1]]


class Mesh:
    """Properties that tetrahedral meshes and sheets share: all that follows from ``nodes`` and ``triangles``."""

    nodes: np.ndarray

    if TYPE_CHECKING:  # only for the type check: each kind of mesh stores or computes these

        @property
        def triangles(self) -> np.ndarray: ...

        @property
        def tetrahedra(self) -> np.ndarray: ...

        @property
        def edges(self) -> np.ndarray: ...

    @cached_property
    def surface(self) -> np.ndarray:
        """Surface nodes, (n_surface,) increasing."""
        return np.unique(self.triangles)

    @cached_property
    def normals(self) -> np.ndarray:
        """Area-weighted outward unit normals, (n_nodes, 3); zero at inner nodes."""
        area_vectors = area_normals(self.nodes, self.triangles)
        normals = np.zeros_like(self.nodes)
        for corner in range(3):
            np.add.at(normals, self.triangles[:, corner], area_vectors)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)

    @cached_property
    def areas(self) -> np.ndarray:
        """A third of the area of the surface triangles around each node, (n_nodes,) [m²]; zero at inner nodes."""
        thirds = np.linalg.norm(area_normals(self.nodes, self.triangles), axis=1) / 6.0
        return np.bincount(self.triangles.ravel(), np.repeat(thirds, 3), minlength=len(self.nodes))

    @cached_property
    def size(self) -> float:
        """Longest side of the bounding box [m]: the meaning of "size of the body" everywhere."""
        return float(np.ptp(self.nodes, axis=0).max())


@dataclass(frozen=True, eq=False)
class TetMesh(Mesh):
    """A tetrahedral mesh in its rest state.

    nodes : (n_nodes, 3) float64 [m]
    tetrahedra : (n_tetrahedra, 4) int64, positively oriented
    """

    nodes: np.ndarray
    tetrahedra: np.ndarray

    @cached_property
    def volumes(self) -> np.ndarray:
        """Signed element volumes, (n_tetrahedra,) [m³]; negative where an element is inverted."""
        a, b, c, d = (self.nodes[self.tetrahedra[:, i]] for i in range(4))
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0

    @cached_property
    def triangles(self) -> np.ndarray:
        """Boundary triangles, (n_triangles, 3) node indices, wound outward."""
        faces = self.tetrahedra[:, FACES].reshape(-1, 3)
        order, equals_next = ranked_faces(np.sort(faces, axis=1), len(self.nodes))
        inside = np.append(equals_next, False) | np.insert(equals_next, 0, False)
        return faces[np.sort(order[~inside])]

    @cached_property
    def edges(self) -> np.ndarray:
        """Element edges, (n_edges, 2), each once, smaller node first, in lexicographic order."""
        edges, n = self.tetrahedra[:, EDGES].reshape(-1, 2), len(self.nodes)
        keys = np.unique(edges.min(axis=1) * n + edges.max(axis=1))  # numbers sort many times as fast as rows
        return np.column_stack([keys // n, keys % n])


@dataclass(frozen=True, eq=False)
class Sheet(Mesh):
    """A triangulated sheet in its rest state, with the properties of a ``TetMesh`` and without tetrahedra.

    nodes : (n_nodes, 3) float64 [m]
    triangles : (n_triangles, 3) int64, consistently wound
    thickness_m : of the material, half of it on either side of the triangles [m]
    """

    nodes: np.ndarray
    triangles: np.ndarray
    thickness_m: float

    @property
    def tetrahedra(self) -> np.ndarray:
        """Empty array, (0, 4) int64."""
        return np.empty((0, 4), dtype=np.int64)

    @cached_property
    def edges(self) -> np.ndarray:
        """Triangle edges, (n_edges, 2), each once, smaller node first, in lexicographic order."""
        return triangle_edges(self.triangles)[0]
