"""Static equilibrium of a body that rigid instruments are pushed into, step by step to a depth.

Contact acts at points of the surface with the shape functions of its elements. Newton's method finds the equilibrium
for given multipliers; these are set to the pressures it has found until what overlaps is small against the depth.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import TetMesh
from palpate.effects.instrument import Pose
from palpate.effects.surface_integrals import surface_interpolation
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold, product
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.newton import Product, minimise_by_newton

PENALTY = 20.0
"""Stiffness of contact [Pa/m] over Young's modulus by the length of an element."""
OVERLAP = 1e-3
"""Mean overlap, weighted with the pressure, over the depth, at which the multipliers are right."""
UPDATES, SLOW = 12, 0.5
"""Most updates of the multipliers at one depth, of which two to four are usual, and the least that one has to reduce
the overlap by: quadratic elements of a coarse mesh cannot follow an instrument at all points."""


def _degree_six() -> tuple[np.ndarray, np.ndarray]:
    """Return 12 points (12, 3) of a triangle, barycentric, and weights that add up to 1 (Dunavant 1985)."""
    places, weights = [], []
    for weight, r in ((0.116786275726379, 0.249286745170910), (0.050844906370207, 0.063089014491502)):
        places += [np.roll([1.0 - 2.0 * r, r, r], shift) for shift in range(3)]
        weights += [weight] * 3
    r, s = 0.310352451033785, 0.053145049844816
    for corners in ([r, s, 1.0 - r - s], [s, r, 1.0 - r - s]):
        places += [np.roll(corners, shift) for shift in range(3)]
        weights += [0.082851075618374] * 3
    return np.array(places), np.array(weights) / np.sum(weights)


PLACES, SHARES = _degree_six()


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """q points of a surface that instruments may touch.

    interpolation : sparse (q, n), from the nodes to the points; areas : (q,) the part of the surface of each [m²]
    penalty : (q,) stiffness of contact [Pa/m]; stretch : areas (q,) over those at rest, of positions (n, 3) [m]
    """

    interpolation: sparse.csr_array
    areas: np.ndarray
    penalty: np.ndarray
    stretch: Callable[[np.ndarray], np.ndarray]


def contact_points(
    mesh: TetMesh, order: int, young_pa: float, near: Callable[[np.ndarray], np.ndarray]
) -> ContactPoints:
    """Return points that integrate polynomials of degree 6 on triangles of ``mesh`` with elements of ``order``.

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
    area_m2 : that touches, as it is deformed; pressure_pa : the greatest, on that
    overlap : mean overlap, weighted with the pressure, over the depth
    """

    depth_m: float
    x: np.ndarray
    force: np.ndarray
    area_m2: float
    pressure_pa: float
    overlap: float


class _Side:
    """One instrument's contact: its multipliers, and what of the surface sticks to it.

    pose : where it is; multiplier : (q,) [Pa]; drag : (q, 3) [Pa], of points that stick
    stuck : (q,) which do; grip : (q, 3), where they do, along the instrument's axes from its tip [m]
    """

    def __init__(self, pose: Pose, count: int):
        self.pose, self.multiplier = pose, np.zeros(count)
        self.stuck, self.grip, self.drag = np.zeros(count, dtype=bool), np.zeros((count, 3)), np.zeros((count, 3))

    def held_at(self) -> np.ndarray:
        """Return where points that stick belong, (q, 3) [m]."""
        return self.pose.tip + self.grip @ self.pose.axes


class Indentation(Equilibrium):
    """The static problem on one level of a body that instruments touch; arguments and errors of ``Equilibrium``.

    points : of the surface that may be touched; poses : of the instruments at first touch; sticks : whether what
    touches keeps its place on the instrument
    """

    def __init__(
        self, body: Body, level: int, order: int, points: ContactPoints, poses: Sequence[Pose], sticks: bool = False
    ):
        super().__init__(body, level, order)
        self.points, self._sticks = points, sticks
        self._sides = [_Side(pose, len(points.areas)) for pose in poses]
        self._spread = points.interpolation.T.tocsr()
        absolute = abs(points.interpolation)
        self._lumped, self._lump = absolute.T.tocsr(), absolute.sum(axis=1)
        self._linear = self._linear_at_rest(body, level + 1) if order == 2 else None

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy and that of contact [J]."""
        energy, at, k = super().energy(x), self.points.interpolation @ x, self.points.penalty
        for side in self._sides:
            pressure = self._pressure(side, side.pose.gaps(at)[0])
            energy += 0.5 * float(self.points.areas @ ((pressure**2 - side.multiplier**2) / k))
            if self._sticks:
                drag = self._drag(side, at)
                energy += 0.5 * float(self.points.areas @ (((drag**2).sum(axis=1) - (side.drag**2).sum(axis=1)) / k))
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
        return np.maximum(side.multiplier - self.points.penalty * gaps, 0.0)

    def _drag(self, side: _Side, at: np.ndarray) -> np.ndarray:
        """Return what holds points that stick, (q, 3) [Pa], along the surface of the instrument."""
        off = np.where(side.stuck[:, None], side.held_at() - at, 0.0)
        return self._along(side, side.drag + self.points.penalty[:, None] * off)

    def _along(self, side: _Side, vectors: np.ndarray) -> np.ndarray:
        normals = side.pose.gaps(side.held_at())[1]
        return vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        """Return the products with the stiffness, contact included, and with a preconditioner that has it lumped."""
        stiffness = self._stiffness(x, definite)
        at, k = self.points.interpolation @ x, self.points.penalty
        stiff, bent = np.zeros((len(k), 3, 3)), np.zeros((len(k), 3, 3))
        for side in self._sides:
            gaps, normals = side.pose.gaps(at)
            pressure = self._pressure(side, gaps)
            on = np.flatnonzero(pressure > 0.0)
            stiff[on] += k[on, None, None] * normals[on, :, None] * normals[on, None, :]
            if not definite:
                bent[on] -= pressure[on, None, None] * side.pose.bends(at[on], gaps[on], normals[on])
            if self._sticks:
                normal = side.pose.gaps(side.held_at())[1][side.stuck]
                stiff[side.stuck] += k[side.stuck, None, None] * (np.eye(3) - normal[:, :, None] * normal[:, None, :])
        touched = np.flatnonzero(stiff.any(axis=(1, 2)))
        areas = self.points.areas[touched, None, None]
        blocks, stiff = areas * (stiff + bent)[touched], areas * stiff[touched]
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

    def _with_contact(self, matrix: sparse.bsr_array, touched: np.ndarray, blocks: np.ndarray) -> sparse.bsr_array:
        """Return ``matrix`` with the stiffness of contact lumped on the diagonal."""
        lumped = self._lumped[:, touched] @ (self._lump[touched, None] * blocks.reshape(-1, 9))
        found = matrix.copy()
        found.data[self._multigrid.patterns[-1].diagonal] += lumped.reshape(-1, 3, 3)
        hold(found.indptr, found.indices, found.data, self._held)
        return found

    def push(
        self, direction: np.ndarray, depths: Sequence[float], tolerance: float, updates: int = UPDATES
    ) -> Iterator[Touching]:
        """Push all instruments along the unit vector ``direction`` (3,), and yield what they do at each of ``depths``.

        tolerance : of the residual, over the norm of the nodal forces of contact; updates : most of the multipliers
        Depths [m] are those of a path from first touch, up or down; what sticks lets go where it is pulled off. Raises
        NotConverged.
        """
        x, reached = self.mesh.nodes.copy(), 0.0
        begin = [side.pose for side in self._sides]
        for depth in depths:
            step = depth - reached
            while True:
                for side, pose in zip(self._sides, begin, strict=True):
                    side.pose = pose.moved((reached + step) * direction)
                kept = [(side.multiplier, side.drag) for side in self._sides]
                try:
                    found = self._settle_touching(x, reached + step, tolerance, updates)
                except NotConverged as failure:
                    step *= 0.5
                    if abs(step) < abs(depth) / 64:
                        raise NotConverged(
                            f"{failure}, at a depth of {1e3 * (reached + 2 * step):.3g} mm", failure.history
                        ) from failure
                    for side, (multiplier, drag) in zip(self._sides, kept, strict=True):
                        side.multiplier, side.drag = multiplier, drag
                    continue
                x, reached = found.x, reached + step
                if self._sticks:
                    self._stick(x)
                if reached == depth:
                    break
                step = depth - reached
            yield found

    def _settle_touching(self, x: np.ndarray, depth: float, tolerance: float, updates: int) -> Touching:
        """Find the equilibrium with the instruments where they are, from ``x`` (n, 3) [m], and set the multipliers."""
        overlap = np.inf
        for _ in range(updates):
            x = self._balanced(x, tolerance)
            found, at = self._touching(x, depth), self.points.interpolation @ x
            for side in self._sides:
                if self._sticks:
                    side.drag = self._drag(side, at)
                side.multiplier = self._pressure(side, side.pose.gaps(at)[0])
            if found.overlap <= OVERLAP or found.overlap > SLOW * overlap:
                break
            overlap = found.overlap
        return found

    def _balanced(self, x: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] for the multipliers there are, from ``x`` (n, 3) [m]."""
        scale = self._pushed(x)
        for _ in range(3):  # the forces that the tolerance is of are not known before
            if scale == 0.0 and self._scale(self.force(x)) <= self._rounding:
                return x  # nothing touches
            x = minimise_by_newton(self, x, scale or self._scale(self.force(x)), tolerance).x
            before, scale = scale, self._pushed(x)
            if scale >= 0.5 * before:
                break
        return x

    def _pushed(self, x: np.ndarray) -> float:
        """Return the norm of the nodal forces [N] of contact."""
        return self._scale(self._spread @ sum(self.pushes(x)))

    def _touching(self, x: np.ndarray, depth: float) -> Touching:
        at, stretch = self.points.interpolation @ x, self.points.stretch(x)
        force, area, greatest, overlap, whole = np.zeros(3), 0.0, 0.0, 0.0, 0.0
        for side, push in zip(self._sides, self.pushes(x), strict=True):
            gaps = side.pose.gaps(at)[0]
            pressure = self._pressure(side, gaps)
            on = pressure > 0.0
            force += push.sum(axis=0)
            area += float((self.points.areas * stretch)[on].sum())
            greatest = max(greatest, float((pressure / stretch)[on].max(initial=0.0)))
            weights = self.points.areas * pressure
            overlap, whole = overlap + float(weights @ np.abs(gaps)), whole + float(weights.sum())
        return Touching(depth, x, force, area, greatest, overlap / max(whole * abs(depth), 1e-300))

    def _stick(self, x: np.ndarray) -> None:
        """Let points stick where they have come to touch, and let go of those that do not touch any more."""
        at = self.points.interpolation @ x
        for side in self._sides:
            on = side.multiplier > 0.0
            new = on & ~side.stuck
            side.grip[new] = (at[new] - side.pose.tip) @ side.pose.axes.T
            side.drag[~on | new] = 0.0
            side.stuck = on
