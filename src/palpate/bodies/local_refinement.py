"""Refine a body near a place and near held nodes only: fine elements there, coarse ones elsewhere, without gaps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.bodies.material import Tissue, uniform
from palpate.bodies.mesh import EDGES, Mesh, TetMesh
from palpate.bodies.refinement import halfway, midpoints_between, refine, ten_nodes

_SIDES = np.array([[i for i, edge in enumerate(EDGES) if corner not in edge] for corner in range(4)])
"""The three edges of the face opposite each corner."""


@dataclass(frozen=True, eq=False)
class LocalBody(Body):
    """A body whose levels are finer than its coarse mesh in one place only.

    numbers : for each level, the numbers that its nodes have in the whole body, increasing
    roots : for each level, the coarse tetrahedron that each of its elements is a part of
    """

    numbers: tuple[np.ndarray, ...] = ()
    roots: tuple[np.ndarray, ...] = ()

    def tissue(self, level: int) -> Tissue:
        """Return the materials of the tetrahedra of a level, or of one that splits each of the last one's in eight."""
        count = len(self.levels[level].tetrahedra)
        if self.regions is None:
            return uniform(self.material, count)
        roots = self.roots[min(level % len(self.levels), len(self.roots) - 1)]
        return Tissue(self.regions.materials, np.repeat(self.regions.region[roots], count // len(roots)))


class LocalRefinement:
    """Refinement of a body around a place, with the nodes that its levels have there (Bey 1995, red and green).

    Near the place an element is split into eight, as everywhere in the body's next level. Its neighbours are split into
    two or four, so that no node lies within an edge or a face of another element; those are not split again. Each level
    refines the one before, so displacements of the coarse mesh are a subspace, as on the body's own levels. A library
    that bisects edges would make other nodes than the body's, which may have moved to a smooth surface.

    Levels beyond the body's finest exist near the place only; their new nodes are midpoints.
    """

    def __init__(self, body: Body, depth: int):
        """Prepare the refinement of ``body`` to level ``depth``, at least 1."""
        self._body, self._depth = body, depth
        levels = range(min(depth + 1, len(body.levels)))
        self._of_body = [_Level.of(body.levels[level], level, body.anchors[level]) for level in levels]

    def around(
        self, center: np.ndarray | list[np.ndarray], radius_m: float | Sequence[float], rim_level: int = 0
    ) -> LocalBody:
        """Return the body with every element refined that has a corner within ``radius_m`` [m] of a center.

        center : (3,) or several (k, 3) [m] for all levels, or a list with those of each level that is refined, near
            those of the level before
        radius_m : one for all levels, or one for each that is refined, none larger than the one before
        rim_level : to which elements at the rim of what is held are refined as well, as displacements grow there with
            the root of the distance
        """
        radii = np.broadcast_to(radius_m, self._depth)
        centers_of_levels = center if isinstance(center, list) else [center] * self._depth
        centers = [cKDTree(np.atleast_2d(points)) for points in centers_of_levels]
        body, graded = self._body, list(self._of_body)
        for level in range(len(graded) - 1, self._depth):
            graded.append(graded[-1].split(centers[level], radii[level], level < rim_level))
        marks = _marked_edges(graded[:-1], centers, radii, rim_level)
        levels, numbers = [body.coarse], [np.arange(len(body.coarse.nodes))]
        prolongations, anchors, roots = [], [body.anchors[0]], [np.arange(len(body.coarse.tetrahedra))]
        for level in range(1, self._depth + 1):
            pieces = list(_elements(graded[: level + 1], marks[:level]))
            elements, root_of_element = (np.concatenate(arrays) for arrays in zip(*pieces, strict=True))
            used_nodes = np.unique(elements)
            coarser = graded[level - 1].mesh
            halved_edges = coarser.edges[used_nodes[len(numbers[-1]) :] - len(coarser.nodes)]
            prolongations.append(halfway(len(numbers[-1]), np.searchsorted(numbers[-1], halved_edges)))
            levels.append(TetMesh(graded[level].mesh.nodes[used_nodes], np.searchsorted(used_nodes, elements)))
            anchors.append(midpoints_between(anchors[-1], prolongations[-1]))
            numbers.append(used_nodes)
            roots.append(root_of_element)
        densities = None
        if body.densities is not None:
            densities = [at_nodes[used_nodes] for at_nodes, used_nodes in zip(body.densities, numbers, strict=False)]
            for prolongation in prolongations[len(densities) - 1 :]:
                densities.append(prolongation @ densities[-1])
        fields = (body.name, levels, prolongations, anchors, body.material, body.bed, body.regions, densities)
        return LocalBody(*fields, numbers=tuple(numbers), roots=tuple(roots))


MARGIN = 2.0
"""Longest edges beyond the radius within which elements get parts, as neighbours of split elements may be split."""


@dataclass(frozen=True, eq=False)
class _Level:
    """Elements of one uniformly refined level, all m of them or those near a place only.

    ten : (m, 10) their nodes as quadratic elements; parents : (m,) the elements of the level before
    first : for each element of the level before, the first of its eight parts, which follow each other, or -1
    roots : (m,) the coarse elements; held : (n,) bool, of the nodes
    """

    mesh: Mesh
    ten: np.ndarray
    parents: np.ndarray
    first: np.ndarray
    roots: np.ndarray
    held: np.ndarray

    @staticmethod
    def of(mesh: Mesh, level: int, anchors: np.ndarray) -> "_Level":
        """Return all elements of ``mesh``, a body's ``level`` with held nodes ``anchors``."""
        each = np.arange(len(mesh.tetrahedra))
        held = np.isin(np.arange(len(mesh.nodes)), anchors)
        return _Level(mesh, ten_nodes(mesh), each // 8, each[::8], each // 8**level, held)

    @property
    def edges(self) -> np.ndarray:
        """The number of each edge of each element, (m, 6)."""
        return self.ten[:, 4:] - len(self.mesh.nodes)

    @property
    def rim(self) -> np.ndarray:
        """The held nodes of elements that have nodes which are not held, increasing."""
        held = self.held[self.mesh.tetrahedra]
        return np.unique(self.mesh.tetrahedra[held & ~held.all(axis=1, keepdims=True)])

    def split(self, center: cKDTree, radius: float, at_rim: bool) -> "_Level":
        """Return the next level: the parts of elements that have a corner within ``radius`` [m], and of those beside.

        at_rim : whether elements with a corner at the rim of what is held are split as well
        """
        corners, (finer, _) = self.mesh.nodes[self.mesh.tetrahedra], refine(self.mesh)
        outside_m = center.query(corners)[0].min(axis=1) - radius
        if at_rim and len(rim_nodes := self.rim):
            outside_m = np.minimum(outside_m, cKDTree(self.mesh.nodes[rim_nodes]).query(corners)[0].min(axis=1))
        longest = np.linalg.norm(corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]], axis=2).max(axis=1)
        chosen = np.flatnonzero(outside_m <= MARGIN * longest[outside_m <= 0.0].max(initial=0.0))
        mesh = TetMesh(finer.nodes, finer.tetrahedra.reshape(-1, 8, 4)[chosen].reshape(-1, 4))
        first_part = np.full(len(corners), -1)
        first_part[chosen] = 8 * np.arange(len(chosen))
        held = np.concatenate([self.held, self.held[self.mesh.edges].all(axis=1)])
        return _Level(mesh, ten_nodes(mesh), np.repeat(chosen, 8), first_part, np.repeat(self.roots[chosen], 8), held)


def _marked_edges(graded: list[_Level], centers: list[cKDTree], radii: np.ndarray, rim_level: int) -> list[np.ndarray]:
    """Return which edges of each level are halved, (n_edges,) bool.

    Levels are marked from the finest one down: what a level splits has to be a part of an element of the level before
    that is split into eight.
    """
    marks: list[np.ndarray] = []
    split_in_eight = np.empty(0, dtype=np.int64)
    for level_number, (level, radius) in reversed(list(enumerate(zip(graded, radii, strict=True)))):
        edges = level.edges
        within_radius = centers[level_number].query(level.mesh.nodes)[0] <= radius
        if level_number < rim_level:
            within_radius[level.rim] = True
        marked = np.zeros(len(level.mesh.edges), dtype=bool)
        marked[edges[within_radius[level.mesh.tetrahedra].any(axis=1)]] = True
        marked[edges[split_in_eight]] = True
        _complete_marks(edges, marked)
        marks.insert(0, marked)
        split_in_eight = np.unique(level.parents[marked[edges].any(axis=1)])
    return marks


def _elements(graded: list[_Level], marks: list[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the elements that halving edges ``marks`` makes: nodes (m, 4) of the last level, coarse elements (m,)."""
    to_split = np.arange(len(graded[0].mesh.tetrahedra))
    for level, finer, marked in zip(graded[:-1], graded[1:], marks, strict=True):
        halved, ten = marked[level.edges[to_split]], level.ten[to_split]
        for pattern, children in _PATTERNS:
            chosen = (halved == pattern).all(axis=1)
            yield ten[chosen][:, children].reshape(-1, 4), np.repeat(level.roots[to_split[chosen]], len(children))
        to_split = (finer.first[to_split[halved.all(axis=1)], None] + np.arange(8)).ravel()
    yield graded[-1].mesh.tetrahedra[to_split], graded[-1].roots[to_split]


def _complete_marks(edges: np.ndarray, marked: np.ndarray) -> None:
    """Mark more edges, in place, until each element has none marked, one, the three of a face, or all six."""
    while True:
        face_edges = marked[edges][:, _SIDES]
        count = marked[edges].sum(axis=1)
        unfinished = (count > 1) & (count < 6) & ~((count == 3) & face_edges.all(axis=2).any(axis=1))
        if not unfinished.any():
            return
        lacks_one_edge = face_edges.sum(axis=2) == 2
        two_of_a_face = unfinished & (count == 2) & lacks_one_edge.any(axis=1)
        marked[edges[:, _SIDES][lacks_one_edge & two_of_a_face[:, None]]] = True
        marked[edges[unfinished & ~two_of_a_face]] = True


def _patterns() -> list[tuple[np.ndarray, np.ndarray]]:
    """List which edges (6,) bool of an element are halved, and its parts (k, 4) by corners 0 to 3, midpoints 4 to 9."""
    patterns = [(np.zeros(6, dtype=bool), np.array([[0, 1, 2, 3]]))]
    for number, (i, j) in enumerate(EDGES):
        patterns.append((np.arange(6) == number, np.array([_with({j: 4 + number}), _with({i: 4 + number})])))
    for corner, side in enumerate(_SIDES):
        middle = {tuple(EDGES[edge]): 4 + int(edge) for edge in side}
        i, j, k = (other for other in range(4) if other != corner)
        ij, ik, jk = middle[i, j], middle[i, k], middle[j, k]
        parts = [{j: ij, k: ik}, {i: ij, k: jk}, {i: ik, j: jk}, {i: jk, j: ik, k: ij}]
        patterns.append((np.isin(np.arange(6), side), np.array([_with(part) for part in parts])))
    return patterns


def _with(replaced: dict[int, int]) -> list[int]:
    """Return the four corners, some of them replaced; the element stays as it is oriented."""
    return [replaced.get(corner, corner) for corner in range(4)]


_PATTERNS = _patterns()
"""All splits of an element but that into eight."""
