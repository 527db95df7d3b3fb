"""Static equilibrium of a body that rigid instruments are pushed into, step by step to a depth.

Contact acts at points of the surface with the shape functions of its elements. L-BFGS, and Newton's method where that
is slow, finds the equilibrium for given multipliers; these are set to the pressures it has found until what overlaps is
small against the depth.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh
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
"""Most updates of the multipliers at one depth, of which two to four are usual, and the least that one has to reduce
the overlap by, or contact becomes stiffer."""
FIRMNESS_FACTOR, MOST_FIRMNESS, FOLLOWED = 10.0, 1e3, 5e-3
"""Factor by which, and the most: where a law stiffens, the body is that much stiffer than its Young's modulus, and
multipliers grow by a small share in each update. Below an overlap of FOLLOWED contact stays as it is: quadratic
elements of a coarse mesh cannot follow an instrument at all points, however stiff it is."""
HELD = 0.1
"""Overlap that is no solution: the instrument is pushed into nodes that do not move."""
TOUCHED = 0.15
"""Mean pressure of a triangle, over the greatest, from which it counts as touched. Pressures at points are no measure:
they alternate, as the surface of an element cannot follow the instrument at all of them."""
GRIP = 4.0
"""Stiffness with which points stick, over that with which contact begins and not grows to: what sticks depends on the
way there."""
AT_FIRST, AFTER = 1.0 / 2.0, 2.0 / 3.0
"""Shares of the way that points slide in a step without sticking, at the time at which they touch: ahead of an area
that grows evenly and sticks the surface follows (Mindlin 1949), by 1 − 2/π asin(a/r) of what it would slide."""
STRIDE = 0.5
"""Longest step over the radius of an instrument, which would pass through the surface in one of two radii."""
STICKING_STEPS = 4
"""Least steps to the largest depth where points stick: the force then differs by 0.1 to 0.5 % from that of twice as
many."""
FIRST = 1e-2
"""Tolerance of the equilibrium for the multipliers at the start of a step, which are about to change."""
DESCENT, DESCENT_RATIO = 10, 0.5
"""Steps of L-BFGS with one set of points that touch in its matrix, and the share to which they have to bring the
residual, or Newton's method is faster: one of its iterations takes as long as 15 to 20 of these steps."""
STICKING = 0.01
"""Force on points that come to stick or let go, over that on all, above which the multipliers are set again."""


def _degree_four() -> tuple[np.ndarray, np.ndarray]:
    """Return 6 points (6, 3) of a triangle, barycentric, and weights that add up to 1 (Dunavant 1985)."""
    places, weights = [], []
    for weight, r in ((0.223381589678011, 0.445948490915965), (0.109951743655322, 0.091576213509771)):
        places += [np.roll([1.0 - 2.0 * r, r, r], shift) for shift in range(3)]
        weights += [weight] * 3
    return np.array(places), np.array(weights) / np.sum(weights)


PLACES, SHARES = _degree_four()


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """q points of a surface that instruments may touch.

    interpolation : sparse (q, n), from the nodes to the points; areas : (q,) the part of the surface of each [m²]
    penalty : (q,) stiffness of contact [Pa/m]; stretch : areas (q,) over those at rest, of positions (n, 3) [m]
    together : how many points, one after another, are of one triangle
    """

    interpolation: sparse.csr_array
    areas: np.ndarray
    penalty: np.ndarray
    stretch: Callable[[np.ndarray], np.ndarray]
    together: int = len(PLACES)

    def of_triangles(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of ``values`` (q,) over the points of each triangle."""
        return values.reshape(-1, self.together).sum(axis=1)


def contact_points(mesh: Mesh, order: int, young_pa: float, near: Callable[[np.ndarray], np.ndarray]) -> ContactPoints:
    """Return points that integrate polynomials of degree 4 on triangles of ``mesh`` with elements of ``order``.

    near : from points (k, 3) [m] to which of them (k,) may touch; triangles with such a corner, edge or middle are kept
    """
    corners = mesh.nodes[mesh.triangles]
    looked = np.concatenate(
        [corners, 0.5 * (corners + np.roll(corners, 1, axis=1)), corners.mean(axis=1, keepdims=True)], 1
    )
    chosen = np.flatnonzero(near(looked.reshape(-1, 3)).reshape(len(corners), -1).any(axis=1))
    if not len(chosen):
        raise NotConverged("no part of the surface is near the instrument", [float("nan")])
    sides = corners[chosen, 1:] - corners[chosen, :1]
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    triangles, places = np.repeat(chosen, len(PLACES)), np.tile(PLACES, (len(chosen), 1))
    maps = [surface_interpolation(mesh, triangles, places + shift, order) for shift in _SHIFTS]
    along = [(maps[1 + 2 * i] - maps[2 + 2 * i]) / (2.0 * _STEP) for i in range(2)]
    at_rest = np.repeat(2.0 * areas, len(PLACES))

    def stretch(x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(np.cross(along[0] @ x, along[1] @ x), axis=1) / at_rest

    penalty = PENALTY * young_pa / np.sqrt(2.0 * areas)
    return ContactPoints(maps[0], np.outer(areas, SHARES).ravel(), np.repeat(penalty, len(PLACES)), stretch)


_STEP = 0.25
"""Step in barycentric coordinates; central differences of quadratic shape functions are exact."""
_SHIFTS = [np.zeros(3)] + [sign * _STEP * (np.eye(3)[i] - np.eye(3)[0]) for i in (1, 2) for sign in (1.0, -1.0)]


class Touching(NamedTuple):
    """What an instrument does to a body at one depth.

    depth_m : from first touch [m]
    x : (n, 3) [m], the nodes
    force : (3,) [N], of the instrument on the body
    area_m2 : of the triangles that touch, as they are deformed; pressure_pa : the greatest mean over one of them
    overlap : mean overlap, weighted with the pressure, over the depth
    """

    depth_m: float
    x: np.ndarray
    force: np.ndarray
    area_m2: float
    pressure_pa: float
    overlap: float


def at_depth(depth: float, _: float = 0.0) -> str:
    """Say where an instrument is."""
    return f"at a depth of {1e3 * depth:.3g} mm"


class _Side:
    """One instrument's contact: its multipliers, and what of the surface sticks to it.

    pose : where it is; multiplier : (q,) [Pa]; drag : (q, 3) [Pa], of points that stick
    stuck : (q,) which do; grip : (q, 3), where they do, along the instrument's axes from its tip [m]
    seen : (q, 3), of a copy, where points were, the same
    """

    def __init__(self, pose: Pose, count: int):
        self.pose, self.multiplier = pose, np.zeros(count)
        self.stuck, self.grip, self.drag = np.zeros(count, dtype=bool), np.zeros((count, 3)), np.zeros((count, 3))
        self.seen = np.zeros((0, 3))

    def held_at(self) -> np.ndarray:
        """Return where points that stick belong, (q, 3) [m]."""
        return self.held(self.grip)

    def held(self, places: np.ndarray) -> np.ndarray:
        """Return where ``places`` (q, 3) on the instrument, along its axes from its tip [m], are (q, 3) [m]."""
        return self.pose.tip + places @ self.pose.axes

    def as_seen(self, at: np.ndarray) -> "_Side":
        """Return a copy, with places of points ``at`` (q, 3) [m] from the instrument."""
        other = _Side(self.pose, len(self.multiplier))
        other.multiplier, other.drag = self.multiplier, self.drag
        other.stuck, other.grip = self.stuck, self.grip.copy()
        other.seen = (at - self.pose.tip) @ self.pose.axes.T
        return other


class Indentation(Equilibrium):
    """The static problem on one level of a body that instruments touch; arguments and errors of ``Equilibrium``.

    points : of the surface that may be touched; poses : of the instruments at first touch; sticks : whether what
    touches keeps its place on the instrument
    """

    def __init__(
        self, body: Body, level: int, order: int, points: ContactPoints, poses: Sequence[Pose], sticks: bool = False
    ):
        self._linear: sparse.bsr_array | None = None
        super().__init__(body, level, order)
        self.points, self._sticks = points, sticks
        self.begin(poses)
        self._spread = points.interpolation.T.tocsr()
        absolute = abs(points.interpolation)
        self._lumped, self._lump = absolute.T.tocsr(), absolute.sum(axis=1)

    def begin(self, poses: Sequence[Pose]) -> None:
        """Take other instruments, or the same elsewhere, at first touch."""
        self._begin, self._firmness = list(poses), 1.0
        self._sides = [_Side(pose, len(self.points.areas)) for pose in poses]

    @property
    def _penalty(self) -> np.ndarray:
        """The stiffness of contact (q,) [Pa/m]."""
        return self._firmness * self.points.penalty

    def _precondition_by(self, linear: OnSupports) -> None:
        self._linear = linear.stiffness(self.mesh.nodes, definite=False)

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy and that of contact [J]."""
        energy, at, k = super().energy(x), self.points.interpolation @ x, self._penalty
        for side in self._sides:
            pressure = self._pressure(side, side.pose.gaps(at)[0])
            energy += 0.5 * float(self.points.areas @ ((pressure**2 - side.multiplier**2) / k))
            if self._sticks:
                drag, grip = self._drag(side, at), GRIP * self.points.penalty
                energy += 0.5 * float(self.points.areas @ (((drag**2).sum(axis=1) - (side.drag**2).sum(axis=1)) / grip))
        return energy

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic force and that of contact (n, 3) [N], zero at held nodes."""
        force = super().force(x) + self._spread @ sum(self.pushes(x))
        force[self._held] = 0.0
        return force

    def pushes(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the force (q, 3) [N] of each instrument on the points of a body at ``x`` (n, 3) [m]."""
        at, found = self.points.interpolation @ x, []
        for side in self._sides:
            gaps, normals = side.pose.gaps(at)
            push = self._pressure(side, gaps)[:, None] * normals
            if self._sticks:
                push += self._drag(side, at)
            found.append(self.points.areas[:, None] * push)
        return found

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the distance (q,) [m] of each point from the nearest instrument, of a body at ``x`` (n, 3) [m]."""
        at = self.points.interpolation @ x
        return np.min([side.pose.gaps(at)[0] for side in self._sides], axis=0)

    def _pressure(self, side: _Side, gaps: np.ndarray) -> np.ndarray:
        return np.maximum(side.multiplier - self._penalty * gaps, 0.0)

    def _drag(self, side: _Side, at: np.ndarray) -> np.ndarray:
        """Return what holds points that stick, (q, 3) [Pa], along the surface of the instrument."""
        off = np.where(side.stuck[:, None], side.held_at() - at, 0.0)
        return self._along(side, side.drag + GRIP * self.points.penalty[:, None] * off)

    def _along(self, side: _Side, vectors: np.ndarray) -> np.ndarray:
        normals = side.pose.gaps(side.held_at())[1]
        return vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness, contact included, and with a preconditioner that has it lumped."""
        stiffness = self._supported.stiffness(x, definite)
        touched, stiff, bent = self._stiffness_of_contact(x)
        blocks = stiff if definite else stiff + bent
        near, spread, elastic = self.points.interpolation[touched], self._spread[:, touched], product(stiffness)

        def multiply(moved: np.ndarray) -> np.ndarray:
            found = elastic(moved) + spread @ np.einsum("qij,qj->qi", blocks, near @ moved)
            found[self._held] = moved[self._held]
            return found

        if self._multigrid is not None:
            self._multigrid.update(
                self._with_contact(stiffness if self._linear is None else self._linear, touched, stiff)
            )
        return multiply, self._precondition

    def _stiffness_of_contact(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the k points that touch (k,), and their stiffness and what curvature adds, (k, 3, 3) [N/m]."""
        at, k = self.points.interpolation @ x, self._penalty
        stiff, bent = np.zeros((len(k), 3, 3)), np.zeros((len(k), 3, 3))
        for side in self._sides:
            gaps, normals = side.pose.gaps(at)
            pressure = self._pressure(side, gaps)
            on = np.flatnonzero(pressure > 0.0)
            stiff[on] += k[on, None, None] * normals[on, :, None] * normals[on, None, :]
            bent[on] -= pressure[on, None, None] * side.pose.bends(at[on], gaps[on], normals[on])
            if self._sticks:
                normal = side.pose.gaps(side.held_at())[1][side.stuck]
                grip = GRIP * self.points.penalty[side.stuck, None, None]
                stiff[side.stuck] += grip * (np.eye(3) - normal[:, :, None] * normal[:, None, :])
        touched = np.flatnonzero(stiff.any(axis=(1, 2)))
        areas = self.points.areas[touched, None, None]
        return touched, areas * stiff[touched], areas * bent[touched]

    def _with_contact(self, matrix: sparse.bsr_array, touched: np.ndarray, blocks: np.ndarray) -> sparse.bsr_array:
        """Return ``matrix`` with the stiffness of contact lumped on the diagonal."""
        lumped = self._lumped[:, touched] @ (self._lump[touched, None] * blocks.reshape(-1, 9))
        assert self._multigrid is not None
        found = matrix.copy()
        found.data[self._multigrid.patterns[-1].diagonal] += lumped.reshape(-1, 3, 3)
        hold(found.indptr, found.indices, found.data, self._held)
        return found

    def push(
        self,
        direction: np.ndarray,
        depths: Sequence[float],
        tolerance: float,
        updates: int = UPDATES,
        guess: Callable[[float, np.ndarray], np.ndarray] = lambda depth, x: x,
    ) -> Iterator[Touching]:
        """Push all instruments from first touch along the unit vector ``direction`` (3,), and yield what they do.

        tolerance : of the residual, over the norm of the nodal forces of contact; updates : most of the multipliers
        guess : from a depth [m] and the positions (n, 3) [m] before it to those at which the search begins
        Depths [m] are those of a path from first touch, up or down; what sticks lets go where it is pulled off. Raises
        InputError for a depth that is negative or larger than the body is along ``direction``, and NotConverged, also
        where what touches is held, an element is inverted, or no point of the surface touches.
        """
        largest = float(np.ptp(self.mesh.nodes @ direction))
        for depth in depths:
            if not 0.0 <= depth < largest:
                raise InputError(f"a depth is {depth:g} m; give 0 to {largest:.3g} m, the body along the direction.")
        scale, reached, begin = max(depths, default=0.0), 0.0, self._begin
        self.begin(begin)
        most = STRIDE * min((pose.instrument.radius_m for pose in begin), default=np.inf)
        most = min(most, scale / STICKING_STEPS) if self._sticks else most
        rest = found = Touching(0.0, self.mesh.nodes.copy(), np.zeros(3), 0.0, 0.0, 0.0)

        def settle(before: Touching, depth: float, _: float) -> Touching:
            at = self.points.interpolation @ before.x
            kept = [side.as_seen(at) for side in self._sides]
            for side, pose in zip(self._sides, begin, strict=True):
                side.pose = pose.moved(depth * direction)
            try:
                return self._settle_touching(guess(depth, before.x), depth, tolerance, kept, updates)
            except NotConverged:
                self._sides = kept
                raise

        for depth in depths:
            if depth == 0.0:  # exactly, not but for what first touch and multipliers leave
                self._sides = [_Side(pose, len(self.points.areas)) for pose in begin]
                found, reached = rest, 0.0
                yield found
                continue
            way = steps_to(depth, reached, scale, found, settle, at_depth, most)
            for reached, found in way:
                if (det := self.least_det(found.x)) <= 0.0:
                    raise NotConverged(f"an element is inverted {at_depth(reached)}", [det])
            if not found.area_m2:
                raise NotConverged(f"nothing touches {at_depth(depth)}: elements are too large", [0.0])
            yield found

    def _settle_touching(
        self, x: np.ndarray, depth: float, tolerance: float, before: list["_Side"], updates: int
    ) -> Touching:
        """Find the equilibrium with the instruments where they are, from ``x`` (n, 3) [m], and set the multipliers.

        before : the sides before the step, with their ``_Side.seen``
        """
        overlap, first = np.inf, FIRST if updates > 1 else tolerance
        for update in range(updates):
            x = self._balanced(x, max(tolerance, first) if update == 0 else tolerance)
            found, at = self._touching(x, depth), self.points.interpolation @ x
            for side in self._sides:
                if self._sticks:
                    side.drag = self._drag(side, at)
                side.multiplier = self._pressure(side, side.pose.gaps(at)[0])
            if self._sticks and self._stick(at, before) > STICKING:
                continue
            if update == 0 and tolerance < first:
                continue
            if found.overlap <= OVERLAP:
                break
            if found.overlap > OVERLAP_RATIO * overlap:
                if found.overlap <= FOLLOWED or self._firmness >= MOST_FIRMNESS:
                    break
                self._firmness *= FIRMNESS_FACTOR
            overlap = found.overlap
        if found.overlap > HELD:
            raise NotConverged(
                f"the instrument overlaps the body by {found.overlap:.0%} of its depth: what it touches is held",
                [found.overlap],
            )
        return found

    def _balanced(self, x: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] for the multipliers there are, from ``x`` (n, 3) [m]."""
        if self._linear is not None:
            x, settled = self._descended(x, tolerance)
            if settled:
                return x
        scale = self._pushed(x)
        for _ in range(3):  # the forces that the tolerance is of are not known before
            if scale == 0.0 and self._scale(self.force(x)) <= self._rounding:
                return x  # nothing touches
            x = self.balance(x, scale or self._scale(self.force(x)), tolerance).x
            before, scale = scale, self._pushed(x)
            if scale >= 0.5 * before:
                break
        return x

    def _descended(self, x: np.ndarray, tolerance: float) -> tuple[np.ndarray, bool]:
        """Return where L-BFGS comes to from ``x`` (n, 3) [m], and whether that is the equilibrium.

        It begins with the stiffness at rest and that of what touches, which is looked at every DESCENT steps. ``x`` is
        returned where the energy is not convex on the way.
        """
        assert self._multigrid is not None
        start, scale = x, self._pushed(x)
        while scale > 0.0:
            self._multigrid.update(self._with_contact(self._linear, *self._stiffness_of_contact(x)[:2]))
            way = minimise_by_lbfgs(self, self._precondition, x, tolerance * scale, DESCENT)
            if not way.convex:
                return start, False
            x, left, scale = way.x, way.forces[-1], self._pushed(way.x)
            if left <= tolerance * scale:
                return x, True
            if len(way.forces) > DESCENT and left > DESCENT_RATIO * way.forces[0]:
                break
        return x, False

    def _pushed(self, x: np.ndarray) -> float:
        """Return the norm of the nodal forces [N] of contact."""
        return self._scale(self._spread @ sum(self.pushes(x)))

    def _touching(self, x: np.ndarray, depth: float) -> Touching:
        at, stretch = self.points.interpolation @ x, self.points.stretch(x)
        areas = self.points.of_triangles(self.points.areas * stretch)
        force, area, greatest, overlap, whole = np.zeros(3), 0.0, 0.0, 0.0, 0.0
        for side, push in zip(self._sides, self.pushes(x), strict=True):
            gaps = side.pose.gaps(at)[0]
            weights, off = self.points.areas * self._pressure(side, gaps), np.abs(gaps)
            mean = self.points.of_triangles(weights) / areas
            force += push.sum(axis=0)
            area += float(areas[mean > TOUCHED * mean.max()].sum())
            greatest = max(greatest, float(mean.max()))
            if self._sticks:
                slips = self._along(side, side.held_at() - at)
                off += np.where(side.stuck, np.linalg.norm(slips, axis=1), 0.0)
            overlap, whole = overlap + float(weights @ off), whole + float(weights.sum())
        return Touching(depth, x, force, area, greatest, overlap / max(whole * abs(depth), 1e-300))

    def _stick(self, at: np.ndarray, before: list["_Side"]) -> float:
        """Let points ``at`` (q, 3) [m] stick that have come to touch, and let go of those that do not touch any more.

        They stick to where they were at first touch, between their places before the step and now. Returns the force
        on points that have come to stick or lost their hold, over that on all.
        """
        changed, whole = 0.0, 1e-300
        for side, old in zip(self._sides, before, strict=True):
            on = side.multiplier > 0.0
            late, new, lost = on & ~old.stuck, on & ~side.stuck, side.stuck & ~on
            times, places = np.zeros(len(on)), (at - side.pose.tip) @ side.pose.axes.T
            times[late] = (AFTER if old.stuck.any() else AT_FIRST) * self._when(late, old)
            side.grip[new] = (old.seen + times[:, None] * (places - old.seen))[new]
            side.drag[~on | new], side.stuck = 0.0, on
            force = self.points.areas * np.maximum(side.multiplier, old.multiplier)
            changed, whole = changed + float(force[new | lost].sum()), whole + float(force.sum())
        return changed / whole

    def _when(self, late: np.ndarray, old: "_Side") -> np.ndarray:
        """Return when ``late`` points (q,) bool have come to touch, from 0 to 1 in the step: with evenly growing area.

        The area grows so under a sphere in theory, and nearer points come first. What touches at the start has t = 0.
        """
        gaps, areas = old.pose.gaps(old.held(old.seen))[0][late], self.points.areas[late]
        order, none = np.argsort(gaps), 10.0 * TOUCH_TOLERANCE * old.pose.instrument.radius_m
        whole, ranked = np.append(0.0, np.cumsum(areas[order])), gaps[order]
        # points that are equally far touch together
        before, until = (whole[np.searchsorted(ranked, gaps + shift)] for shift in (-none, none))
        return np.where(gaps <= none, 0.0, 0.5 * (before + until) / max(whole[-1], 1e-300))
