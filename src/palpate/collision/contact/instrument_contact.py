"""Contact of instruments with a part of a body's surface, for searches in few coordinates: without trees and limits.

The stencils of a few hundred nodes are looked through as they are, and the barrier goes on as its parabola where hardly
any gap is left, so that nothing is infinite and no step of a search has to be cut short.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.contact import barrier, friction
from palpate.collision.contact.barrier import Surface, stencils, thresholds
from palpate.collision.contact.obstacles import Obstacle
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, boxes_apart, closest, closest_points
from palpate.effects.effect import Rigid

SOFT = 0.05
"""Part of the gap below which the barrier goes on as its parabola; a motion that is believed keeps more."""
PLACES = 60
"""On its path, at which it is seen what an instrument may touch."""
CORNER = 0.01
"""Part of a step by which a corner of the path may lie before it."""


class Rubbing(NamedTuple):
    """Friction during a step: directions and normal forces of an earlier state, as ``friction`` takes them.

    nodes, weights : (a, 4); normals : (a, 3); limits : (a,) [N]; slip : [m]; start : (k, 3) [m]
    """

    nodes: np.ndarray
    weights: np.ndarray
    normals: np.ndarray
    limits: np.ndarray
    slip: float
    start: np.ndarray


class InstrumentContact:
    """The barrier and friction between the triangles that ``nodes`` (k,) span and instruments.

    Points are these nodes, then those of all instruments, (k + p, 3) [m].
    stencils : the first arguments of the functions of barrier and friction, in the numbers of points
    reactions : (i, 3) [N], the force on each instrument at the end of the last step; work_j : as of the effect; whoever
        steps writes them
    """

    def __init__(
        self,
        nodes: np.ndarray,
        rest: np.ndarray,
        triangles: np.ndarray,
        strength: np.ndarray,
        obstacles: Sequence[Obstacle],
        gap_m: float,
        coefficient: float,
        slip_m_s: float,
    ):
        """Take the body's nodes (n, 3) [m] at ``rest``, its ``triangles`` (m, 3), its ``strength`` (n,) [N]."""
        self.nodes, self.obstacles, self.work_j = nodes, obstacles, 0.0
        self.coefficient, self.slip_m_s, self._rest = coefficient, slip_m_s, rest
        self.reactions, self._triangles = np.zeros((len(obstacles), 3)), triangles
        place = np.full(len(rest), -1)
        place[nodes] = np.arange(len(nodes))
        own = place[triangles]
        own = own[(own >= 0).all(axis=1)]
        counts = [len(nodes), *(len(o.points) for o in obstacles)]
        starts = np.cumsum(counts)
        self.ranges = [slice(a, a + c) for a, c in zip(starts[:-1], counts[1:], strict=True)]
        points = np.vstack([rest[nodes], self.at(0.0)])
        strengths = np.append(strength[nodes], np.zeros(len(points) - len(nodes)))
        found = [_pairs(own, o.triangles + start) for o, start in zip(obstacles, starts[:-1], strict=True)]
        kinds, corners = (np.concatenate(each) for each in zip(*found, strict=True))
        offsets = np.repeat([o.radius_m for o in obstacles], [len(each[0]) for each in found])
        pulling = strengths[corners]
        scales = pulling.sum(axis=1) / np.maximum((pulling > 0.0).sum(axis=1), 1)
        mollify = thresholds(kinds, corners, points)
        self.stencils = kinds, corners, offsets, scales, mollify, gap_m, SOFT
        none = np.empty((0, 4), np.int64), np.empty((0, 4)), np.empty((0, 3)), np.empty(0)
        self._unrubbed = Rubbing(*none, 1.0, np.zeros_like(points))

    @property
    def count(self) -> int:
        """The number of points."""
        return self.ranges[-1].stop

    @property
    def duration_s(self) -> float:
        """The time from which on no instrument moves [s]."""
        return max((float(o.times_s[-1]) for o in self.obstacles if len(o.times_s)), default=0.0)

    def at(self, t: float) -> np.ndarray:
        """Compute the instruments' points (p, 3) [m] at the time ``t`` [s]."""
        return np.vstack([o.at(t) for o in self.obstacles])

    def bends(self, t: float, h: float) -> bool:
        """Tell whether a path has a corner where a step of ``h`` [s] from ``t`` [s] begins, or within it."""
        times = np.concatenate([o.times_s for o in self.obstacles])
        return bool(((times > t - CORNER * h) & (times < t + (1.0 - CORNER) * h)).any())

    def rubbing(self, points: np.ndarray, start: np.ndarray, reach: float) -> Rubbing:
        """Return friction at ``points`` (k + p, 3) [m] against motion from ``start`` in ``reach`` [s]."""
        if not self.coefficient:
            return self._unrubbed
        _, nodes, weights, normals, forces = friction.pressing(*self.stencils, points)
        return Rubbing(nodes, weights, normals, self.coefficient * forces, self.slip_m_s * reach, start)

    def strays(self, x: np.ndarray, t: float) -> bool:
        """Tell whether a node (n, 3) [m] that is not among ``nodes`` is inside an instrument at the time ``t`` [s]."""
        others = np.setdiff1d(self._triangles, self.nodes)
        return any((distances(x[others], o, t) < o.radius_m).any() for o in self.obstacles)


def distances(places: np.ndarray, obstacle: Rigid, t: float) -> np.ndarray:
    """Compute the distances (k,) [m] of ``places`` (k, 3) [m] from an obstacle without its thickness."""
    count, triangles = len(places), obstacle.triangles
    points = np.vstack([places, obstacle.at(t)])
    nodes = np.column_stack([np.repeat(np.arange(count), len(triangles)), np.tile(triangles + count, (count, 1))])
    found = closest_points(np.full(len(nodes), POINT_TRIANGLE), nodes, points)[0]
    return found.reshape(count, len(triangles)).min(axis=1)


def _pairs(own: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """List kinds (s,) and nodes (s, 4) of all stencils of triangles (m, 3) and (q, 3)."""
    pairs = np.stack(np.meshgrid(np.arange(len(own)), np.arange(len(other)), indexing="ij"), axis=2).reshape(-1, 2)
    return stencils(Surface(own), Surface(other), pairs)


def reachable(
    rest: np.ndarray, triangles: np.ndarray, obstacles: Sequence[Rigid], margin_m: float, until_s: float
) -> np.ndarray:
    """Return the nodes (k,) of ``triangles`` (m, 3) that instruments pass within ``margin_m`` [m] until ``until_s``.

    Nodes (n, 3) [m] are where they are at ``rest``; triangles that have one are taken whole.
    """
    near = np.zeros(len(rest), dtype=bool)
    surface = np.unique(triangles)
    for obstacle in obstacles:
        for t in np.linspace(0.0, until_s, PLACES):
            away = distances(rest[surface], obstacle, t)
            near[surface[away < obstacle.radius_m + margin_m]] = True
    return np.unique(triangles[near[triangles].any(axis=1)])


@numba.njit(cache=True)
def near_of(kinds, nodes, offsets, scales, mollify, gap, soft, x):
    """Return the numbers (a,) of the stencils that are within the gap or whose boxes do not show that they are not."""
    found, count = np.empty(len(kinds), np.int64), 0
    for k in range(len(kinds)):
        if not boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            found[count] = k
            count += 1
    return found[:count]


@numba.njit(cache=True)
def press(stencils, rubbing, points, force):
    """Write forces [N] on ``points`` (k, 3) [m] into ``force`` and return the energy [J], friction's included."""
    kinds, nodes, offsets, scales, mollify, gap, soft = stencils
    near = near_of(kinds, nodes, offsets, scales, mollify, gap, soft, points)
    kinds, nodes, offsets, scales, mollify = kinds[near], nodes[near], offsets[near], scales[near], mollify[near]
    force[:] = 0.0
    energy = barrier.energy(kinds, nodes, offsets, scales, mollify, gap, soft, points)
    barrier.add_force(kinds, nodes, offsets, scales, mollify, gap, soft, points, force)
    lagged, weights, normals, limits, slip, start = rubbing
    if len(limits):
        energy += friction.energy(lagged, weights, normals, limits, slip, points, start)
        friction.add_force(lagged, weights, normals, limits, slip, points, start, force)
    return energy


@numba.njit(cache=True)
def stiffen(stencils, rubbing, points, place):
    """Compute the definite Hessian (3a, 3a) [N/m] of the points whose ``place`` (k,) is 0 to a − 1, not −1."""
    kinds, nodes, offsets, scales, mollify, gap, soft = stencils
    near = near_of(kinds, nodes, offsets, scales, mollify, gap, soft, points)
    kinds, nodes, offsets, scales, mollify = kinds[near], nodes[near], offsets[near], scales[near], mollify[near]
    count = 3 * (place.max() + 1)
    found = np.zeros((count, count))
    active, blocks = barrier.blocks(kinds, nodes, offsets, scales, mollify, gap, soft, points, True)
    _scatter(nodes[active], blocks, place, found)
    lagged, weights, normals, limits, slip, start = rubbing
    if len(limits):
        _scatter(lagged, friction.blocks(lagged, weights, normals, limits, slip, points, start, True), place, found)
    return found


@numba.njit(cache=True)
def least_gap(stencils, points):
    """Return the smallest clearance over the gap; 1 if nothing is within it."""
    kinds, nodes, offsets, scales, mollify, gap, soft = stencils
    least, weights = 1.0, np.empty(4)
    for k in near_of(kinds, nodes, offsets, scales, mollify, gap, soft, points):
        least = min(least, (closest(kinds[k], points, nodes[k], weights)[0] - offsets[k]) / gap)
    return least


@numba.njit(cache=True)
def _scatter(nodes, blocks, place, out):
    for k in range(len(nodes)):
        for a in range(4):
            p = place[nodes[k, a]]
            if p < 0:
                continue
            for b in range(4):
                o = place[nodes[k, b]]
                if o < 0:
                    continue
                for i in range(3):
                    for j in range(3):
                        out[3 * p + i, 3 * o + j] += blocks[k, a, b, i, j]
