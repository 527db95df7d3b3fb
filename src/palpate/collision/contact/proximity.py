"""Pairs of near parts of surfaces, found anew only when others can have come near, and how far they may move."""

from dataclasses import dataclass

import numba
import numpy as np

from palpate.collision.contact import barrier
from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils, thresholds
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import candidates, overlapping_trees, self_candidates
from palpate.collision.triangles.closest_points import closest, closest_points, separation

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
        """Return those whose ``known`` clearance is at most ``distance`` [m], and now smaller by ``lost`` [m]."""
        count = int(np.searchsorted(self.known, distance, side="right"))
        return self._select(slice(count), self.known[:count] - lost)

    @property
    def barrier(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
        """First arguments of the functions of barrier and friction."""
        return self.kinds, self.nodes, self.offsets, self.scales, self.mollify, self.gap

    def by_clearance(self, points: np.ndarray) -> "NearStencils":
        """Return the stencils sorted by their clearance at ``points`` (n, 3) [m], the smallest first."""
        clearances = self.clearances(points)
        order = np.argsort(clearances, kind="stable")
        return self._select(order, clearances[order])

    def _select(self, rows: np.ndarray | slice, known: np.ndarray) -> "NearStencils":
        return NearStencils(
            self.kinds[rows], self.nodes[rows], self.offsets[rows], self.scales[rows], self.mollify[rows], self.gap,
            self.pieces[rows], known,
        )  # fmt: skip

    def clearances(self, points: np.ndarray) -> np.ndarray:
        """Return the distances between the parts less their radii, (k,) [m]."""
        return closest_points(self.kinds, self.nodes, points)[0] - self.offsets

    def limit(self, points: np.ndarray, motion: np.ndarray) -> float:
        """Return the fraction of ``motion`` (n, 3) [m] that ``points`` can make before anything touches."""
        return limit(self.kinds, self.nodes, self.offsets, self.known, points, motion)

    def blocks(self, points: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray]:
        """Compute nodes (a, 4) and the Hessian's blocks (a, 4, 4, 3, 3) [N/m] of the active stencils."""
        active, blocks = barrier.blocks(*self.barrier, points, definite)
        return self.nodes[active], blocks


class Proximity:
    """The search for stencils with a clearance below ``gap`` [m], or that may come so near within a given motion.

    points : (n, 3) [m] at rest; surfaces : triangles (m, 3) of each piece; thicknesses : (p,) [m]
    can_touch : (p, p) bool, which pieces can touch, on the diagonal which can touch themselves
    strengths : (n,) [N] of the barrier at each point; owners : (n,) the piece of each point
    movable : (n,) bool; stencils of points none of which is movable are left out
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
        """Return the stencils that may touch while ``points`` (n, 3) [m] move by up to ``travel`` [m].

        A new search is made only if points have moved far; else the last one's stencils are returned whose clearance
        was so small that the motion since, and ``travel``, may have closed it.
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
        """Return all stencils within the reach, those with least clearance first."""
        for tree, thickness in zip(self._trees, self._thicknesses, strict=True):
            tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
            if tree.needs_rebuild:
                tree.rebuild(points)
                tree.refit(points, margin=thickness + 0.5 * self._gap + self._reach)
        lists = [self._stencils_between(i, j) for i, j in self._pairs()]
        kinds = np.concatenate([kinds for kinds, _ in lists] or [np.empty(0, np.int64)])
        nodes = np.concatenate([nodes for _, nodes in lists] or [np.empty((0, 4), np.int64)])
        pieces = self.owners[nodes[:, [0, 3]]]
        offsets = self._thicknesses[pieces].sum(axis=1)
        clearance = closest_points(kinds, nodes, points)[0] - offsets
        near = np.flatnonzero((clearance <= self._gap + 2.0 * self._reach) & self.movable[nodes].any(axis=1))
        near = near[np.argsort(clearance[near], kind="stable")]
        kinds, nodes, offsets, pieces = kinds[near], nodes[near], offsets[near], pieces[near]
        strengths = self._strengths[nodes]
        scales = strengths.sum(axis=1) / np.maximum((strengths > 0.0).sum(axis=1), 1)
        mollify = thresholds(kinds, nodes, self._rest)
        return NearStencils(kinds, nodes, offsets, scales, mollify, self._gap, pieces, clearance[near])

    def _pairs(self) -> list[tuple[int, int]]:
        """Return the pieces that can touch themselves, and pairs that can touch and whose bounding volumes overlap."""
        overlapping = overlapping_trees(self._trees).tolist()
        return [(i, i) for i in self._adjacent] + [(i, j) for i, j in overlapping if self._can_touch[i, j]]

    def _stencils_between(self, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        if i == j:
            pairs = np.vstack([self_candidates(self._trees[i])[0], self._adjacent[i]])
        else:
            pairs = candidates(self._trees[i], self._trees[j])[0]
        return stencils(self._surfaces[i], self._surfaces[j], pairs)


SLACK = 0.1
"""Relative tolerance of the clearance to be kept, within which the search ends."""

MAX_STEPS = 1000
"""Most advances of one stencil; if more were needed, the part found safe until then is returned."""


@numba.njit(cache=True)
def limit(kinds, nodes, offsets, clearances, x, motion, keep=0.1):
    """Return the largest t in [0, 1] for which a motion by t ``motion`` leaves each stencil ``keep`` of its clearance.

    kinds : (k,); nodes : (k, 4); offsets : (k,) [m]; x, motion : (n, 3) [m]; clearance is distance − offset
    clearances : (k,) [m], known lower bounds, which save the search where little moves; 0 if unknown
    It is 1 where no parts come that close; 0 where parts touch or overlap already, or the motion is not finite.

    Additive CCD (Li, Kaufman and Jiang 2021, algorithm 1): distances are bounded below for the length of a step,
    again and again, until little clearance is left; no roots are sought, so none is missed. The paper bounds the loss
    by the fastest nodes' speeds. Here a step may also be as long as a second bound allows: the two parts lie on either
    side of a slab across the direction n of their closest points, so min n·(xᵢ − xⱼ) over the nodes i of one part and j
    of the other, each of which changes linearly, is less than the distance at any time; sliding past costs one step.
    Traps: conservative; t may be short of the possible by SLACK of the kept clearance, and by more where parts rotate
    fast at hardly any clearance, so that MAX_STEPS end the search.
    """
    work, least = (np.empty((4, 3)), np.empty((4, 3)), np.empty(4)), 1.0
    for k in range(len(kinds)):
        if (
            clearances[k] > 0.0
            and _relative_motion(kinds[k], nodes[k], motion) < (1.0 - (1.0 + SLACK) * keep) * clearances[k]
        ):
            continue
        least = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, least, work)
    return least


@numba.njit(cache=True)
def _relative_motion(kind, nodes, motion):
    """Compute the largest relative motion [m] of a node of one part and one of the other; NaN if not finite."""
    n_first, largest = kind + 1, 0.0
    for i in range(n_first):
        for j in range(n_first, 4):
            square = 0.0
            for a in range(3):
                square += (motion[nodes[i], a] - motion[nodes[j], a]) ** 2
            if not square <= largest:
                largest = square
    return np.sqrt(largest)


@numba.njit(cache=True)
def limits(kinds, nodes, offsets, x, motion, keep=0.1):
    """Find the ``limit`` of each stencil by itself, (k,)."""
    work, fractions = (np.empty((4, 3)), np.empty((4, 3)), np.empty(4)), np.empty(len(kinds))
    for k in range(len(kinds)):
        fractions[k] = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, 1.0, work)
    return fractions


@numba.njit(cache=True)
def _advance(kind, nodes, offset, x, motion, keep, longest, work):
    """Return the limit of one stencil, or ``longest`` if that is less; work : scratch of nodes, velocities, weights."""
    places, velocity, weights = work
    size = _velocities(nodes, motion, velocity)
    if not np.isfinite(size):
        return 0.0
    t, margin, rows = 0.0, 0.0, np.arange(4)
    for step in range(MAX_STEPS):
        for i in range(4):
            for j in range(3):
                places[i, j] = x[nodes[i], j] - x[nodes[0], j] + t * velocity[i, j]
        distance, _ = closest(kind, places, rows, weights)
        if step == 0:
            if not distance - offset > 0.0:
                return 0.0
            margin = keep * (distance - offset)
        elif distance - offset <= (1.0 + SLACK) * margin:
            return t / size
        t += _safe_step(kind, places, velocity, separation(places, rows, weights), distance, offset + margin)
        if t >= longest * size:
            return longest
    return t / size


@numba.njit(cache=True)
def _velocities(nodes, motion, velocity):
    """Write motions relative to the first node's over their largest component, and return that, or 1 if it is 0.

    So squares of very long and short motions neither overflow nor vanish.
    """
    size = 0.0
    for i in range(4):
        for j in range(3):
            velocity[i, j] = motion[nodes[i], j] - motion[nodes[0], j]
            if not np.isfinite(velocity[i, j]):
                return np.inf
            size = max(size, abs(velocity[i, j]))
    if size == 0.0:
        return 1.0
    velocity /= size
    return size


@numba.njit(cache=True, error_model="numpy")
def _safe_step(kind, y, velocity, r, distance, least):
    """Return a time for which the distance is sure to exceed ``least`` [m]: the longer bound of two, by slab and speed.

    Where rounding of ``r`` tilts the slab so that nodes reach into it, only the bound by speed counts, as it needs no
    direction. It is infinite if nothing moves.
    """
    n_first, by_slab, fastest = kind + 1, np.inf, 0.0
    for i in range(n_first):
        for j in range(n_first, 4):
            apart, closing, square = 0.0, 0.0, 0.0
            for a in range(3):
                speed = velocity[j, a] - velocity[i, a]
                apart += r[a] / distance * (y[i, a] - y[j, a])
                closing += r[a] / distance * speed
                square += speed * speed
            fastest = max(fastest, square)
            if apart < least:
                by_slab = 0.0
            elif closing > 0.0:
                by_slab = min(by_slab, (apart - least) / closing)
    return max(by_slab, (distance - least) / np.sqrt(fastest)) if fastest > 0.0 else np.inf
