"""What is near what: found by trees, and kept for as long as nothing else can have come near."""

from dataclasses import dataclass

import numpy as np

from palpate.collision.contact import additive_ccd, barrier
from palpate.collision.contact.mollifier import thresholds
from palpate.collision.contact.stencils import Surface, stencils, touching_pairs
from palpate.collision.trees.broad_phase import meeting
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import candidates, self_candidates
from palpate.collision.triangles.closest_points import closest_points

ROOM = 1.5
"""How much farther than it must a search looks, so that what it finds serves several steps."""


@dataclass(frozen=True, eq=False)
class Near:
    """Stencils whose two parts may come to touch, and the barrier between them.

    kinds : (k,); nodes : (k, 4); offsets : (k,) [m]; scales : (k,) [N]; mollify : (k,) [m⁴], all as barrier.energy
    has them; gap : [m]; pieces : (k, 2) the surfaces that the first and the second part are of; known : (k,) [m], what
    room there is between the parts at least
    """

    kinds: np.ndarray
    nodes: np.ndarray
    offsets: np.ndarray
    scales: np.ndarray
    mollify: np.ndarray
    gap: float
    pieces: np.ndarray
    known: np.ndarray

    def closer(self, than: float, lost: float) -> "Near":
        """Those with less room than ``than`` [m], ``lost`` [m] of which may be gone by now; they are sorted by room."""
        count = int(np.searchsorted(self.known, than, side="right"))
        arrays = (self.kinds, self.nodes, self.offsets, self.scales, self.mollify)
        known = self.known[:count] - lost
        return Near(*(array[:count] for array in arrays), self.gap, self.pieces[:count], known)

    @property
    def barrier(self) -> tuple:
        """What the functions of barrier and friction take first."""
        return self.kinds, self.nodes, self.offsets, self.scales, self.mollify, self.gap

    def sorted(self, points: np.ndarray) -> "Near":
        """The same, those with least room at ``points`` (n, 3) [m] first."""
        rooms = self.rooms(points)
        order = np.argsort(rooms, kind="stable")
        arrays = (self.kinds, self.nodes, self.offsets, self.scales, self.mollify)
        return Near(*(array[order] for array in arrays), self.gap, self.pieces[order], rooms[order])

    def rooms(self, points: np.ndarray) -> np.ndarray:
        """How far apart they are, (k,) [m], radii taken off."""
        return closest_points(self.kinds, self.nodes, points)[0] - self.offsets

    def limit(self, points: np.ndarray, ways: np.ndarray) -> float:
        """The part of ``ways`` (n, 3) [m] that ``points`` can go until something would touch."""
        return additive_ccd.limit(self.kinds, self.nodes, self.offsets, self.known, points, ways)

    def blocks(self, points: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (a, 4) and the Hessian's blocks (a, 4, 4, 3, 3) [N/m] of the stencils that act."""
        active, blocks = barrier.blocks(*self.barrier, points, definite)
        return self.nodes[active], blocks


class Proximity:
    """Finds what is less than ``gap`` [m] from touching, or may get there while no point goes farther than a reach.

    points : (n, 3) [m] at rest; surfaces : triangles (m, 3) of each piece; thicknesses : (p,) [m]; able : (p, p)
    bool, which pieces can meet, on the diagonal which can meet themselves; strengths : (n,) [N] of the barrier at each
    point; movable : (n,) bool, nothing is looked for between points none of which moves; owners : (n,) their pieces
    """

    def __init__(self, points, surfaces, thicknesses, able, strengths, gap: float):
        self._surfaces = [Surface(triangles) for triangles in surfaces]
        self._trees = [Tree(points, triangles) for triangles in surfaces]
        self._rest, self._thicknesses, self._able = points.copy(), thicknesses, able
        self.owners = np.zeros(len(points), dtype=np.int64)
        for number, triangles in enumerate(surfaces):
            self.owners[triangles] = number
        self._strengths, self._gap = strengths, gap
        self._beside = {i: touching_pairs(surfaces[i]) for i in np.flatnonzero(np.diag(able))}
        self.movable = np.ones(len(points), dtype=bool)
        self._near, self._seen, self._reach, self._way = None, points, -1.0, 0.0

    def look(self, points: np.ndarray, way: float) -> Near:
        """What may touch while ``points`` (n, 3) [m] go up to ``way`` [m] farther; found anew if they have gone far.

        Of what was found before it is what had less room then than both parts may have lost since.
        """
        gone = float(np.sqrt(np.square(points - self._seen).sum(axis=1).max()))
        self._way = max(way, self._way if way == 0.0 else 0.0)
        if gone + way > self._reach:
            self._reach, self._seen, gone = ROOM * way + self._gap, points.copy(), 0.0
            self._near = self._search(points)
        elif gone > 2.0 * (self._gap + self._way):
            # what all points have gone together says nothing of their rooms: look at these again
            self._reach, self._seen, gone = self._reach - gone, points.copy(), 0.0
            self._near = self._near.sorted(points)
        return self._near.closer(self._gap + 2.0 * (gone + way), 2.0 * gone)

    def _search(self, points: np.ndarray) -> Near:
        """All stencils within the reach, those with least room first."""
        for tree, thickness in zip(self._trees, self._thicknesses, strict=True):
            tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
            if tree.worn:
                tree.rebuild(points)
                tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
        found = [self._between(i, j) for i, j in self._pairs()]
        kinds = np.concatenate([kinds for kinds, _ in found] or [np.empty(0, np.int64)])
        nodes = np.concatenate([nodes for _, nodes in found] or [np.empty((0, 4), np.int64)])
        pieces = self.owners[nodes[:, [0, 3]]]
        offsets = self._thicknesses[pieces].sum(axis=1)
        room = closest_points(kinds, nodes, points)[0] - offsets
        kept = np.flatnonzero((room <= self._gap + 2.0 * self._reach) & self.movable[nodes].any(axis=1))
        kinds, nodes, offsets, pieces = kinds[kept], nodes[kept], offsets[kept], pieces[kept]
        strengths = self._strengths[nodes]
        scales = strengths.sum(axis=1) / np.maximum((strengths > 0.0).sum(axis=1), 1)
        mollify = thresholds(kinds, nodes, self._rest)
        return Near(kinds, nodes, offsets, scales, mollify, self._gap, pieces, room[kept]).sorted(points)

    def _pairs(self) -> list[tuple[int, int]]:
        """Pieces that can meet themselves, and pairs that can meet and whose roots do."""
        meet = meeting(self._trees) if len(self._trees) > 1 else []
        return [(i, i) for i in self._beside] + [(int(i), int(j)) for i, j in meet if self._able[i, j]]

    def _between(self, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        if i == j:
            pairs = np.vstack([self_candidates(self._trees[i])[0], self._beside[i]])
        else:
            pairs = candidates(self._trees[i], self._trees[j])[0]
        return stencils(self._surfaces[i], self._surfaces[j], pairs)
