"""Search for near pairs by trees, and reuse of the result for as long as no other pair can have come near."""

from dataclasses import dataclass

import numpy as np

from palpate.collision.contact import additive_ccd, barrier
from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils, thresholds
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import candidates, overlapping_trees, self_candidates
from palpate.collision.triangles.closest_points import closest_points

REACH_FACTOR = 1.5
"""Factor by which a search reaches farther than necessary, so that its result serves several steps."""


@dataclass(frozen=True, eq=False)
class NearStencils:
    """Stencils whose two parts may come to touch, and the barrier between them.

    kinds : (k,); nodes : (k, 4); offsets : (k,) [m]; scales : (k,) [N]; mollify : (k,) [m⁴], all as in barrier.energy;
    gap : [m]; pieces : (k, 2) the surfaces of the first and the second part; known : (k,) [m], lower bounds of the
    clearance between the parts, increasing
    """

    kinds: np.ndarray
    nodes: np.ndarray
    offsets: np.ndarray
    scales: np.ndarray
    mollify: np.ndarray
    gap: float
    pieces: np.ndarray
    known: np.ndarray

    def within(self, distance: float, lost: float) -> "NearStencils":
        """Select those with less clearance than ``distance`` [m], ``lost`` [m] of which may be lost by now."""
        count = int(np.searchsorted(self.known, distance, side="right"))
        return self._select(slice(count), self.known[:count] - lost)

    @property
    def barrier(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
        """First arguments of the functions of barrier and friction."""
        return self.kinds, self.nodes, self.offsets, self.scales, self.mollify, self.gap

    def by_clearance(self, points: np.ndarray) -> "NearStencils":
        """Sort by clearance at ``points`` (n, 3) [m], the smallest first."""
        clearances = self.clearances(points)
        order = np.argsort(clearances, kind="stable")
        return self._select(order, clearances[order])

    def _select(self, rows: np.ndarray | slice, known: np.ndarray) -> "NearStencils":
        return NearStencils(
            self.kinds[rows], self.nodes[rows], self.offsets[rows], self.scales[rows], self.mollify[rows], self.gap,
            self.pieces[rows], known,
        )  # fmt: skip

    def clearances(self, points: np.ndarray) -> np.ndarray:
        """Compute the distances less the radii, (k,) [m]."""
        return closest_points(self.kinds, self.nodes, points)[0] - self.offsets

    def limit(self, points: np.ndarray, motion: np.ndarray) -> float:
        """Find the fraction of ``motion`` (n, 3) [m] that ``points`` can make until something would touch."""
        return additive_ccd.limit(self.kinds, self.nodes, self.offsets, self.known, points, motion)

    def blocks(self, points: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray]:
        """Compute nodes (a, 4) and the Hessian's blocks (a, 4, 4, 3, 3) [N/m] of the active stencils."""
        active, blocks = barrier.blocks(*self.barrier, points, definite)
        return self.nodes[active], blocks


class Proximity:
    """Search for stencils that are less than ``gap`` [m] from touching, or may become so within a given motion.

    points : (n, 3) [m] at rest; surfaces : triangles (m, 3) of each piece; thicknesses : (p,) [m]; can_touch : (p, p)
    bool, which pieces can touch, on the diagonal which can touch themselves; strengths : (n,) [N] of the barrier at
    each point; movable : (n,) bool, points none of which moves are not compared; owners : (n,) their pieces
    """

    def __init__(
        self,
        points: np.ndarray,
        surfaces: list[np.ndarray],
        thicknesses: np.ndarray,
        can_touch: np.ndarray,
        strengths: np.ndarray,
        gap: float,
    ):
        self._surfaces = [Surface(triangles) for triangles in surfaces]
        self._trees = [Tree(points, triangles) for triangles in surfaces]
        self._rest, self._thicknesses, self._can_touch = points.copy(), thicknesses, can_touch
        self.owners = np.zeros(len(points), dtype=np.int64)
        for number, triangles in enumerate(surfaces):
            self.owners[triangles] = number
        self._strengths, self._gap = strengths, gap
        self._adjacent = {int(i): adjacent_pairs(surfaces[i]) for i in np.flatnonzero(np.diag(can_touch))}
        self.movable = np.ones(len(points), dtype=bool)
        self._near: NearStencils | None = None
        self._searched_at, self._reach, self._travel = points, -1.0, 0.0

    def find_near(self, points: np.ndarray, travel: float) -> NearStencils:
        """Find the stencils that may touch while ``points`` (n, 3) [m] move by up to ``travel`` [m].

        Searches anew only if points have moved far; otherwise selects from the last result those whose clearance was
        then less than both parts may have lost since.
        """
        moved = float(np.sqrt(np.square(points - self._searched_at).sum(axis=1).max()))
        self._travel = max(travel, self._travel if travel == 0.0 else 0.0)
        if self._near is None or moved + travel > self._reach:
            self._reach, self._searched_at, moved = REACH_FACTOR * travel + self._gap, points.copy(), 0.0
            self._near = self._search(points)
        elif moved > 2.0 * (self._gap + self._travel):
            # a common motion of all points does not change their clearances: compute these again
            self._reach, self._searched_at, moved = self._reach - moved, points.copy(), 0.0
            self._near = self._near.by_clearance(points)
        return self._near.within(self._gap + 2.0 * (moved + travel), 2.0 * moved)

    def _search(self, points: np.ndarray) -> NearStencils:
        """Find all stencils within the reach, those with least clearance first."""
        for tree, thickness in zip(self._trees, self._thicknesses, strict=True):
            tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
            if tree.needs_rebuild:
                tree.rebuild(points)
                tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
        found = [self._stencils_between(i, j) for i, j in self._pairs()]
        kinds = np.concatenate([kinds for kinds, _ in found] or [np.empty(0, np.int64)])
        nodes = np.concatenate([nodes for _, nodes in found] or [np.empty((0, 4), np.int64)])
        pieces = self.owners[nodes[:, [0, 3]]]
        offsets = self._thicknesses[pieces].sum(axis=1)
        clearance = closest_points(kinds, nodes, points)[0] - offsets
        kept = np.flatnonzero((clearance <= self._gap + 2.0 * self._reach) & self.movable[nodes].any(axis=1))
        kept = kept[np.argsort(clearance[kept], kind="stable")]
        kinds, nodes, offsets, pieces = kinds[kept], nodes[kept], offsets[kept], pieces[kept]
        strengths = self._strengths[nodes]
        scales = strengths.sum(axis=1) / np.maximum((strengths > 0.0).sum(axis=1), 1)
        mollify = thresholds(kinds, nodes, self._rest)
        return NearStencils(kinds, nodes, offsets, scales, mollify, self._gap, pieces, clearance[kept])

    def _pairs(self) -> list[tuple[int, int]]:
        """List pieces that can touch themselves, and pairs that can touch and whose roots overlap."""
        overlapping = overlapping_trees(self._trees).tolist()
        return [(i, i) for i in self._adjacent] + [(i, j) for i, j in overlapping if self._can_touch[i, j]]

    def _stencils_between(self, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        if i == j:
            pairs = np.vstack([self_candidates(self._trees[i])[0], self._adjacent[i]])
        else:
            pairs = candidates(self._trees[i], self._trees[j])[0]
        return stencils(self._surfaces[i], self._surfaces[j], pairs)
