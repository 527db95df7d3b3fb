"""Static equilibrium of a body that rigid instruments are pushed into, step by step to a depth.

Contact acts at points of the surface, whose forces the shape functions of its elements pass on to nodes. It is an
augmented Lagrangian: L-BFGS, and Newton's method where that is slow, finds the equilibrium for given multipliers; these
are then set to the pressures of that equilibrium, until points overlap the instrument by a small part of the depth.
"""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh, corner_normals
from palpate.bodies.surface_quadrature import surface_interpolation
from palpate.effects.instrument import TOUCH_TOLERANCE, Pose
from palpate.errors import InputError, NotConverged
from palpate.linalg.block_pattern import hold, product
from palpate.linalg.minimiser import Product, minimise_by_lbfgs
from palpate.solvers.continuation import steps_to
from palpate.solvers.equilibrium import Equilibrium, OnSupports

PENALTY = 20.0
"""Stiffness of contact [Pa/m] over Young's modulus by the length of an element."""
OVERLAP = 1e-3
"""Mean overlap, weighted with the pressure, over the depth, at which the multipliers are right."""
UPDATES, OVERLAP_RATIO = 12, 0.5
"""Most updates of the multipliers at one depth, of which two to four are usual; and the fraction of its overlap to
which an update has to bring it, or the penalty is raised."""
PENALTY_FACTOR, MOST_PENALTY, RESOLVED_OVERLAP = 10.0, 1e3, 5e-3
"""Factor by which the penalty is raised, and the most that it is raised to over that at first: a law may make the body
stiffer than its Young's modulus, and multipliers then grow slowly. Below an overlap of RESOLVED_OVERLAP it stays:
quadratic elements of a coarse mesh cannot take the shape of an instrument at all points, however large it is."""
NO_SOLUTION = 0.1
"""Overlap from which a state is no solution: the instrument is pushed into nodes that do not move."""
TOUCHED = 0.15
"""Mean pressure of a triangle, over the greatest, from which it counts as touched. Pressures at points are no measure:
they alternate, as the surface of an element cannot follow the instrument at all of them."""
GRIP = 4.0
"""Tangential stiffness of points that stick, over the penalty before it is raised: what sticks depends on the path."""
AT_FIRST, AFTER = 1.0 / 2.0, 2.0 / 3.0
"""Fraction of its displacement in a step that a point has when it comes to touch, in the first step with contact and in
later ones: outside an area that grows evenly and sticks, the surface is dragged along (Mindlin 1949), by 1 − 2/π
asin(a/r) of how far it would slide."""
LONGEST_STEP = 0.5
"""Longest step over the radius of an instrument, which would pass through the surface in a step of two radii."""
STICKING_STEPS = 4
"""Least steps to the largest depth where points stick: the force then differs by 0.1 to 0.5 % from that of twice as
many."""
FIRST_TOLERANCE = 1e-2
"""Tolerance of the equilibrium for the multipliers at the start of a step, which are about to change."""
DESCENT, DESCENT_RATIO = 10, 0.5
"""Iterations of L-BFGS between updates of which points touch in its matrix, and the fraction to which they have to
bring the residual, or Newton's method is faster: one of its iterations takes as long as 15 to 20 of these."""
STICKING = 0.01
"""Force on points that begin or cease to stick, over that on all, above which the multipliers are set again."""


def _degree_four() -> tuple[np.ndarray, np.ndarray]:
    """Return 6 quadrature points (6, 3) of a triangle, barycentric, and weights (6,) of sum 1 (Dunavant 1985)."""
    places, weights = [], []
    for weight, r in ((0.223381589678011, 0.445948490915965), (0.109951743655322, 0.091576213509771)):
        places += [np.roll([1.0 - 2.0 * r, r, r], shift) for shift in range(3)]
        weights += [weight] * 3
    return np.array(places), np.array(weights) / np.sum(weights)


PLACES, WEIGHTS = _degree_four()


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """q points of a surface at which it may touch instruments.

    interpolation : sparse (q, n), from nodes to points; areas : (q,) the part of the surface at each [m²]
    penalty : (q,) stiffness of contact [Pa/m]; stretch : from positions (n, 3) [m] to areas (q,) over those at rest
    per_triangle : how many points, one after another, are of one triangle
    """

    interpolation: sparse.csr_array
    areas: np.ndarray
    penalty: np.ndarray
    stretch: Callable[[np.ndarray], np.ndarray]
    per_triangle: int = len(PLACES)

    def of_triangles(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of ``values`` (q,) over the points of each triangle."""
        return values.reshape(-1, self.per_triangle).sum(axis=1)

    @cached_property
    def spread(self) -> sparse.csr_array:
        """The map (n, q) from forces on the points to nodal forces."""
        return self.interpolation.T.tocsr()

    def lumped(self, touched: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
        """Return diagonal blocks (n, 3, 3) [N/m] that bound the ``stiffness`` (k, 3, 3) of k ``touched`` points.

        Each is split among nodes by the absolute values of the shape functions at its point, times their sum.
        """
        to_nodes, sums = self._sizes
        return (to_nodes[:, touched] @ (sums[touched, None] * stiffness.reshape(-1, 9))).reshape(-1, 3, 3)

    @cached_property
    def _sizes(self) -> tuple[sparse.csr_array, np.ndarray]:
        """The absolute values of the shape functions (n, q), and their sum at each point (q,)."""
        absolute = abs(self.interpolation)
        return absolute.T.tocsr(), absolute.sum(axis=1)


def contact_points(mesh: Mesh, order: int, young_pa: float, near: Callable[[np.ndarray], np.ndarray]) -> ContactPoints:
    """Return quadrature points, exact to degree 4, of triangles of ``mesh`` with elements of ``order``.

    near : from points (k, 3) [m] to which of them (k,) may touch; asked for the corners, midpoints and centroid of each
        triangle, of which one has to be near
    NotConverged if no triangle is.
    """
    corners = mesh.nodes[mesh.triangles]
    samples = np.concatenate(
        [corners, 0.5 * (corners + np.roll(corners, 1, axis=1)), corners.mean(axis=1, keepdims=True)], 1
    )
    touchable = np.flatnonzero(near(samples.reshape(-1, 3)).reshape(len(corners), -1).any(axis=1))
    if not len(touchable):
        raise NotConverged("no part of the surface is near the instrument", [float("nan")])
    areas = 0.5 * np.linalg.norm(corner_normals(corners[touchable]), axis=1)
    triangles, places = np.repeat(touchable, len(PLACES)), np.tile(PLACES, (len(touchable), 1))
    interpolations = [surface_interpolation(mesh, triangles, places + shift, order) for shift in _SHIFTS]
    tangents = [(interpolations[1 + 2 * i] - interpolations[2 + 2 * i]) / (2.0 * _STEP) for i in range(2)]
    at_rest = np.repeat(2.0 * areas, len(PLACES))

    def stretch(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(np.cross(tangents[0] @ x, tangents[1] @ x), axis=1) / at_rest

    penalty = PENALTY * young_pa / np.sqrt(2.0 * areas)
    return ContactPoints(interpolations[0], np.outer(areas, WEIGHTS).ravel(), np.repeat(penalty, len(PLACES)), stretch)


_STEP = 0.25
"""Step in barycentric coordinates; central differences of quadratic shape functions are exact."""
_SHIFTS = [np.zeros(3)] + [sign * _STEP * (np.eye(3)[i] - np.eye(3)[0]) for i in (1, 2) for sign in (1.0, -1.0)]


class Touching(NamedTuple):
    """The equilibrium of a body with an instrument at one depth.

    depth_m : of the instrument, from first touch [m]
    x : (n, 3) [m], the nodes
    force : (3,) [N], of the instrument on the body
    area_m2 : of the deformed triangles that touch; pressure_pa : the largest mean over one of them
    overlap : mean overlap, weighted by the pressure, over the depth
    """

    depth_m: float
    x: np.ndarray
    force: np.ndarray
    area_m2: float
    pressure_pa: float
    overlap: float


def at_depth(depth: float, _: float = 0.0) -> str:
    """Return the words by which an error names the ``depth`` [m] of an instrument."""
    return f"at a depth of {1e3 * depth:.3g} mm"


class _Side:
    """The contact of one instrument: its multipliers, and which points stick to it.

    pose : of the instrument; multiplier : (q,) [Pa]; traction : (q, 3) [Pa], tangential multiplier of what sticks
    stuck : (q,) bool, which points stick; grip : (q, 3) [m], where on the instrument, along its axes from its tip
    before : (q, 3) [m], of a copy that was made when a step began, where the points were then, along the same axes
    """

    def __init__(self, pose: Pose, count: int):
        self.pose, self.multiplier = pose, np.zeros(count)
        self.stuck, self.grip, self.traction = np.zeros(count, dtype=bool), np.zeros((count, 3)), np.zeros((count, 3))
        self.before = np.zeros((0, 3))

    def in_space(self, places: np.ndarray) -> np.ndarray:
        """Return the positions (q, 3) [m] of ``places`` (q, 3) [m] on the instrument, along its axes from its tip."""
        return self.pose.tip + places @ self.pose.axes

    def copied(self, at: np.ndarray) -> "_Side":
        """Return a copy that knows where the points are, ``at`` (q, 3) [m], when a step begins."""
        other = copy(self)
        other.grip, other.before = self.grip.copy(), (at - self.pose.tip) @ self.pose.axes.T
        return other


class Indentation(Equilibrium):
    """The static problem on one level of a body that instruments touch; other arguments and errors of ``Equilibrium``.

    points : of the surface that may touch; poses : of the instruments at first touch
    sticks : whether points that touch keep their place on the instrument, or slide without friction
    """

    def __init__(
        self, body: Body, level: int, order: int, points: ContactPoints, poses: Sequence[Pose], sticks: bool = False
    ):
        self._linear: sparse.bsr_array | None = None
        super().__init__(body, level, order)
        self.points, self._sticks = points, sticks
        self.begin(poses)

    def begin(self, poses: Sequence[Pose]) -> None:
        """Put instruments at ``poses``, at first touch, in place of those before."""
        self._begin, self._raised = list(poses), 1.0
        self._sides = [_Side(pose, len(self.points.areas)) for pose in poses]

    @property
    def _penalty(self) -> np.ndarray:
        """The stiffness of contact (q,) [Pa/m]."""
        return self._raised * self.points.penalty

    def _precondition_by(self, linear: OnSupports) -> None:
        self._linear = linear.stiffness(self.mesh.nodes, definite=False)

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy and that of contact [J]."""
        energy, places, penalty = super().energy(x), self.points.interpolation @ x, self._penalty
        for side in self._sides:
            pressure = self._pressure(side, side.pose.gaps(places)[0])
            energy += 0.5 * float(self.points.areas @ ((pressure**2 - side.multiplier**2) / penalty))
            if self._sticks:
                squares = (self._traction(side, places) ** 2).sum(axis=1) - (side.traction**2).sum(axis=1)
                energy += 0.5 * float(self.points.areas @ (squares / (GRIP * self.points.penalty)))
        return energy

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic force and that of contact (n, 3) [N], zero at held nodes."""
        force = super().force(x) + self.points.spread @ sum(self.pushes(x))
        force[self._held] = 0.0
        return force

    def pushes(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the force (q, 3) [N] of each instrument on the points of a body at ``x`` (n, 3) [m]."""
        places, forces = self.points.interpolation @ x, []
        for side in self._sides:
            gaps, normals = side.pose.gaps(places)
            push = self._pressure(side, gaps)[:, None] * normals
            if self._sticks:
                push += self._traction(side, places)
            forces.append(self.points.areas[:, None] * push)
        return forces

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the distance (q,) [m] of each point from the nearest instrument, of a body at ``x`` (n, 3) [m]."""
        at = self.points.interpolation @ x
        return np.min([side.pose.gaps(at)[0] for side in self._sides], axis=0)

    def _pressure(self, side: _Side, gaps: np.ndarray) -> np.ndarray:
        return np.maximum(side.multiplier - self._penalty * gaps, 0.0)

    def _traction(self, side: _Side, at: np.ndarray) -> np.ndarray:
        """Return the tangential traction (q, 3) [Pa] on points ``at`` (q, 3) [m], zero on those that do not stick."""
        slip = np.where(side.stuck[:, None], side.in_space(side.grip) - at, 0.0)
        return self._tangential(side, side.traction + GRIP * self.points.penalty[:, None] * slip)

    def _tangential(self, side: _Side, vectors: np.ndarray) -> np.ndarray:
        normals = side.pose.gaps(side.in_space(side.grip))[1]
        return vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness, which has contact, and with a preconditioner that has it lumped."""
        stiffness = self._supported.stiffness(x, definite)
        touched, stiff, bent = self._stiffness_of_contact(x)
        blocks = stiff if definite else stiff + bent
        gather, spread, elastic = self.points.interpolation[touched], self.points.spread[:, touched], product(stiffness)

        def multiply(moved: np.ndarray) -> np.ndarray:
            force = elastic(moved) + spread @ np.einsum("qij,qj->qi", blocks, gather @ moved)
            force[self._held] = moved[self._held]
            return force

        if self._multigrid is not None:
            self._multigrid.update(
                self._with_contact(stiffness if self._linear is None else self._linear, touched, stiff)
            )
        return multiply, self._precondition

    def _stiffness_of_contact(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return which points touch (k,), their stiffness (k, 3, 3) [N/m], and what instruments' curvature adds."""
        places, penalty = self.points.interpolation @ x, self._penalty
        stiff, bent = np.zeros((len(penalty), 3, 3)), np.zeros((len(penalty), 3, 3))
        for side in self._sides:
            gaps, normals = side.pose.gaps(places)
            pressure = self._pressure(side, gaps)
            hits = np.flatnonzero(pressure > 0.0)
            stiff[hits] += penalty[hits, None, None] * normals[hits, :, None] * normals[hits, None, :]
            bent[hits] -= pressure[hits, None, None] * side.pose.bends(places[hits], gaps[hits], normals[hits])
            if self._sticks:
                normal = side.pose.gaps(side.in_space(side.grip))[1][side.stuck]
                grip = GRIP * self.points.penalty[side.stuck, None, None]
                stiff[side.stuck] += grip * (np.eye(3) - normal[:, :, None] * normal[:, None, :])
        touched = np.flatnonzero(stiff.any(axis=(1, 2)))
        areas = self.points.areas[touched, None, None]
        return touched, areas * stiff[touched], areas * bent[touched]

    def _with_contact(self, matrix: sparse.bsr_array, touched: np.ndarray, blocks: np.ndarray) -> sparse.bsr_array:
        """Return ``matrix`` and the stiffness ``blocks`` (k, 3, 3) [N/m] of points that touch, lumped at nodes."""
        assert self._multigrid is not None
        both = matrix.copy()
        both.data[self._multigrid.patterns[-1].diagonal] += self.points.lumped(touched, blocks)
        hold(both.indptr, both.indices, both.data, self._held)
        return both

    def push(
        self,
        direction: np.ndarray,
        depths: Sequence[float],
        tolerance: float,
        updates: int = UPDATES,
        guess: Callable[[float, np.ndarray], np.ndarray] = lambda depth, x: x,
    ) -> Iterator[Touching]:
        """Move all instruments along the unit vector ``direction`` (3,), and yield the equilibrium at each depth.

        depths : from first touch [m], in the order of the path, which may go back; points that stick let go in tension
        tolerance : of the residual, over the norm of the nodal forces of contact; updates : most of the multipliers
        guess : from a depth [m] and the positions (n, 3) [m] before it to those at which the search begins
        Raises InputError for a depth that is negative or larger than the body along ``direction``; NotConverged where
        none is found, the nodes that touch are held, an element is inverted, or no point touches.
        """
        largest = float(np.ptp(self.mesh.nodes @ direction))
        for depth in depths:
            if not 0.0 <= depth < largest:
                raise InputError(f"a depth is {depth:g} m; give 0 to {largest:.3g} m, the body along the direction.")
        deepest, reached, first_poses = max(depths, default=0.0), 0.0, self._begin
        self.begin(first_poses)
        longest = LONGEST_STEP * min((pose.instrument.radius_m for pose in first_poses), default=np.inf)
        longest = min(longest, deepest / STICKING_STEPS) if self._sticks else longest
        untouched = touching = Touching(0.0, self.mesh.nodes.copy(), np.zeros(3), 0.0, 0.0, 0.0)

        def settle(before: Touching, depth: float, _: float) -> Touching:
            places = self.points.interpolation @ before.x
            earlier = [side.copied(places) for side in self._sides]
            for side, pose in zip(self._sides, first_poses, strict=True):
                side.pose = pose.moved(depth * direction)
            try:
                return self._settle_touching(guess(depth, before.x), depth, tolerance, earlier, updates)
            except NotConverged:
                self._sides = earlier
                raise

        for depth in depths:
            if depth == 0.0:  # a search would leave rounding of first touch and of the multipliers
                self._sides = [_Side(pose, len(self.points.areas)) for pose in first_poses]
                touching, reached = untouched, 0.0
                yield touching
                continue
            path = steps_to(depth, reached, deepest, touching, settle, at_depth, longest)
            for reached, touching in path:
                if (det := self.least_det(touching.x)) <= 0.0:
                    raise NotConverged(f"an element is inverted {at_depth(reached)}", [det])
            if not touching.area_m2:
                raise NotConverged(f"nothing touches {at_depth(depth)}: elements are too large", [0.0])
            yield touching

    def _settle_touching(
        self, x: np.ndarray, depth: float, tolerance: float, earlier: list[_Side], updates: int
    ) -> Touching:
        """Find the equilibrium with the instruments where they are, from ``x`` (n, 3) [m], and set the multipliers.

        earlier : copies of the sides from when the step began
        """
        last_overlap, first_tolerance = np.inf, FIRST_TOLERANCE if updates > 1 else tolerance
        for update in range(updates):
            x = self._balanced(x, max(tolerance, first_tolerance) if update == 0 else tolerance)
            touching, places = self._touching(x, depth), self.points.interpolation @ x
            for side in self._sides:
                if self._sticks:
                    side.traction = self._traction(side, places)
                side.multiplier = self._pressure(side, side.pose.gaps(places)[0])
            if self._sticks and self._stick(places, earlier) > STICKING:
                continue
            if update == 0 and tolerance < first_tolerance:
                continue
            if touching.overlap <= OVERLAP:
                break
            if touching.overlap > OVERLAP_RATIO * last_overlap:
                if touching.overlap <= RESOLVED_OVERLAP or self._raised >= MOST_PENALTY:
                    break
                self._raised *= PENALTY_FACTOR
            last_overlap = touching.overlap
        if touching.overlap > NO_SOLUTION:
            raise NotConverged(
                f"the instrument overlaps the body by {touching.overlap:.0%} of its depth: what it touches is held",
                [touching.overlap],
            )
        return touching

    def _balanced(self, x: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] for the present multipliers, found from ``x`` (n, 3) [m]."""
        if self._linear is not None:
            x, found = self._descended(x, tolerance)
            if found:
                return x
        contact_n = self._pushed(x)
        for _ in range(3):  # the tolerance is relative to contact forces, known only at the end
            if contact_n == 0.0 and self._scale(self.force(x)) <= self._rounding:
                return x  # nothing touches
            x = self.balance(x, contact_n or self._scale(self.force(x)), tolerance).x
            earlier, contact_n = contact_n, self._pushed(x)
            if contact_n >= 0.5 * earlier:
                break
        return x

    def _descended(self, x: np.ndarray, tolerance: float) -> tuple[np.ndarray, bool]:
        """Return positions (n, 3) [m] that L-BFGS reaches from ``x`` (n, 3) [m], and whether they are the equilibrium.

        Its matrix has the stiffness at rest and that of the points that touch, which is updated every DESCENT
        iterations. Where the energy is not convex on the path, ``x`` itself is returned.
        """
        assert self._multigrid is not None
        begin, scale = x, self._pushed(x)
        while scale > 0.0:
            self._multigrid.update(self._with_contact(self._linear, *self._stiffness_of_contact(x)[:2]))
            descent = minimise_by_lbfgs(self, self._precondition, x, tolerance * scale, DESCENT)
            if not descent.convex:
                return begin, False
            x, residual, scale = descent.x, descent.forces[-1], self._pushed(descent.x)
            if residual <= tolerance * scale:
                return x, True
            if len(descent.forces) > DESCENT and residual > DESCENT_RATIO * descent.forces[0]:
                break
        return x, False

    def _pushed(self, x: np.ndarray) -> float:
        """Return the norm of the nodal forces [N] of contact."""
        return self._scale(self.points.spread @ sum(self.pushes(x)))

    def _touching(self, x: np.ndarray, depth: float) -> Touching:
        """Return force, area, pressure and overlap of all instruments, of a body at ``x`` (n, 3) [m]."""
        places, stretch = self.points.interpolation @ x, self.points.stretch(x)
        areas = self.points.of_triangles(self.points.areas * stretch)
        force, area, greatest, overlap, pressing = np.zeros(3), 0.0, 0.0, 0.0, 0.0
        for side, push in zip(self._sides, self.pushes(x), strict=True):
            gaps = side.pose.gaps(places)[0]
            forces, misfit = self.points.areas * self._pressure(side, gaps), np.abs(gaps)
            pressures = self.points.of_triangles(forces) / areas
            force += push.sum(axis=0)
            area += float(areas[pressures > TOUCHED * pressures.max()].sum())
            greatest = max(greatest, float(pressures.max()))
            if self._sticks:
                slips = self._tangential(side, side.in_space(side.grip) - places)
                misfit += np.where(side.stuck, np.linalg.norm(slips, axis=1), 0.0)
            overlap, pressing = overlap + float(forces @ misfit), pressing + float(forces.sum())
        return Touching(depth, x, force, area, greatest, overlap / max(pressing * abs(depth), 1e-300))

    def _stick(self, at: np.ndarray, earlier: list[_Side]) -> float:
        """Let points ``at`` (q, 3) [m] that press stick, and others let go; return the share of those that changed.

        A point sticks to the place on the instrument that it had when it came to touch, between that before the step,
        of the copies ``earlier``, and that now. The share is of the force on all points.
        """
        changed, total = 0.0, 1e-300
        for side, at_start in zip(self._sides, earlier, strict=True):
            pressing = side.multiplier > 0.0
            newly, begins, ends = pressing & ~at_start.stuck, pressing & ~side.stuck, side.stuck & ~pressing
            touch_times, here = np.zeros(len(pressing)), (at - side.pose.tip) @ side.pose.axes.T
            touch_times[newly] = (AFTER if at_start.stuck.any() else AT_FIRST) * self._touch_times(newly, at_start)
            side.grip[begins] = (at_start.before + touch_times[:, None] * (here - at_start.before))[begins]
            side.traction[~pressing | begins], side.stuck = 0.0, pressing
            force = self.points.areas * np.maximum(side.multiplier, at_start.multiplier)
            changed, total = changed + float(force[begins | ends].sum()), total + float(force.sum())
        return changed / total

    def _touch_times(self, newly: np.ndarray, at_start: _Side) -> np.ndarray:
        """Return when in the step, from 0 to 1, the points ``newly`` (q,) bool came to touch; at_start : the side then.

        The area is taken to grow evenly, as under a sphere in theory, and points to touch in the order of their gaps
        before the step; those without a gap have the time 0.
        """
        gaps, areas = at_start.pose.gaps(at_start.in_space(at_start.before))[0][newly], self.points.areas[newly]
        order, no_gap = np.argsort(gaps), 10.0 * TOUCH_TOLERANCE * at_start.pose.instrument.radius_m
        grown, ranked = np.append(0.0, np.cumsum(areas[order])), gaps[order]
        # points at the same gap touch together, halfway between the areas before and after them
        area_before, area_after = (grown[np.searchsorted(ranked, gaps + shift)] for shift in (-no_gap, no_gap))
        return np.where(gaps <= no_gap, 0.0, 0.5 * (area_before + area_after) / max(grown[-1], 1e-300))
