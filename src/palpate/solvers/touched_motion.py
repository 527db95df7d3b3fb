"""Quadratic elements in motion under rigid instruments that press, stroke and lift, with friction.

A step has two stages (SDIRK2; Alexander 1977), each the minimum of an energy as a step of backward Euler is. The rule is
of second order and knows no step before its own, so that corners of an instrument's path cost nothing where steps end;
what is stiff, as contact is, it damps, and the end of a step is in balance. The midpoint rule would leave a point of
the surface that comes to touch within a step as deep inside as it was outside.

Contact and friction act at points of the surface as augmented Lagrangians (Alart and Curnier 1991): a point at the gap g
bears the pressure p = max(λ − k g, 0), and where it moves by u along the instrument in a stage the traction d − k u, cut
off at μ p. Multipliers are those of the stage before, set once more within each.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.effects.elements import OnePass
from palpate.effects.instrument import Pose
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold
from palpate.solvers.indentation import ContactPoints
from palpate.solvers.lbfgs import minimise_by_lbfgs
from palpate.solvers.quadratic_motion import MORE_ITERATIONS, MOST_ITERATIONS, QuadraticMotion, Reached

STAGE = 1.0 - np.sqrt(0.5)
"""Length of a stage over that of its step."""
UPDATES, STIFFER = 3, 4.0
"""How often each stage is solved, with multipliers set anew, and the stiffness k over that of contact at rest, which is
set more often: the force of the liver's palpation is then 0.3 % from that of five updates."""


@dataclass(frozen=True, eq=False)
class Touch:
    """What touches a body: points of its surface, the instruments' poses at a time [s], friction.

    friction : Coulomb's coefficient; slip_m_s : speed [m/s] below which what sticks creeps, as ``contact.friction`` says
    """

    points: ContactPoints
    poses: Callable[[float], list[Pose]]
    friction: float
    slip_m_s: float


class TouchedMotion(QuadraticMotion):
    """A held body of quadratic elements that instruments touch; other arguments and errors as ``QuadraticMotion``.

    bearing : which points (q,) bore pressure at the end of the last step
    """

    def __init__(self, body: Body, level: int, loads: dict[str, dict], rayleigh: dict, touch: Touch):
        super().__init__(body, level, loads, rayleigh)
        points = replace(touch.points, penalty=STIFFER * touch.points.penalty)
        self.touch = replace(touch, points=points)
        self.bearing = np.zeros(len(points.areas), dtype=bool)
        self.spread = touch.points.interpolation.T.tocsr()
        absolute = abs(touch.points.interpolation)
        self._lumping, self._lump = absolute.T.tocsr(), absolute.sum(axis=1)

    def touched_steps(self, h: float, count: int, tolerance: float) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s] from rest.

        tolerance : of the forces that do not balance, over the largest norm that those of contact and loads have had
        Raises NotConverged for a stage that is not found.
        """
        x, v, tau = self.mesh.nodes.copy(), np.zeros_like(self.mesh.nodes), STAGE * h
        sides = [_Side.untouched(len(self.touch.points.areas)) for _ in self.touch.poses(0.0)]
        contact, solve = _Contact(self.touch, sides), None
        for number in range(count):
            begin = number * h
            here, there = self.touch.poses(begin), self.touch.poses(begin + h)
            contact.speeds = [(after.tip - before.tip) / h for before, after in zip(here, there, strict=True)]
            base_x, base_v, work, lost, convex = x, v, 0.0, 0.0, True
            mean = np.zeros((len(sides), 3))
            for share, ends in ((1.0 - STAGE, begin + tau), (STAGE, begin + h)):
                contact.begin(self.touch.poses(ends), base_x, tau)
                self.load = self.load_at(ends)
                stage, z = _Stage(self, contact, base_x, base_v, tau), base_x + tau * base_v
                z[self.held] = self.mesh.nodes[self.held]
                for _ in range(UPDATES):
                    if solve is None:
                        solve, first = self._solver(tau, z, contact), None
                    self.scale_n = max(self.scale_n, contact.peak_n)
                    scale = max(self.scale_n, float(np.linalg.norm(self.spread @ contact.total(z))))
                    allowed = max(tolerance * scale, self._rounding)
                    way = minimise_by_lbfgs(stage, solve, z, allowed, MOST_ITERATIONS)
                    if not way.forces[-1] <= allowed:
                        raise NotConverged(
                            f"the stage to {ends:.4g} s stopped after {len(way.forces) - 1} iterations at a residual "
                            f"of {way.forces[-1]:.1e} N, above {allowed:.1e} N",
                            way.forces,
                        )
                    z, convex = way.x, convex and way.convex
                    contact.renew(z)
                    stage.forget()
                    iterations = len(way.forces) - 1
                    first = iterations if first is None else first
                    if iterations > first + MORE_ITERATIONS:
                        solve = None
                contact.peak_n = max(contact.peak_n, float(np.linalg.norm(self.spread @ contact.total(z))))
                velocity = (z - base_x) / tau
                pushes = np.array([push.sum(axis=0) for push in contact.pushes(z)])
                mean += share * pushes
                driven = float(np.vdot(pushes, contact.speeds))
                work += share * h * (float(np.vdot(self.load, velocity)) + driven)
                lost += share * h * (float(np.vdot(velocity, stage.damping(velocity))) + contact.rubbed(z))
                rate = (velocity - base_v) / tau
                base_x, base_v = x + (1.0 - STAGE) * h * velocity, v + (1.0 - STAGE) * h * rate
            x, v = z, velocity
            self.bearing = np.any([side.pressure > 0.0 for side in sides], axis=0)
            yield Reached(x, v, x - self.mesh.nodes, work, lost, convex, mean)

    def _solver(self, tau: float, x: np.ndarray, contact: "_Contact") -> Callable[[np.ndarray], np.ndarray]:
        """Return a multigrid cycle for what linear elements on the same nodes, at ``x`` (n, 3) [m], make of a stage."""
        assert self._multigrid is not None  # quadratic elements have a level below that of their nodes
        matrix = self._linear_stiffness(x)
        matrix.data *= 1.0 + self._beta / tau
        diagonal = self._linear.pattern.diagonal
        matrix.data[diagonal] += ((1.0 / tau**2 + self._alpha / tau) * self._lumped)[:, None, None] * np.eye(3)
        blocks = self._lump[:, None] * contact.stiffness(x).reshape(-1, 9)
        matrix.data[diagonal] += (self._lumping @ blocks).reshape(-1, 3, 3)
        hold(matrix.indptr, matrix.indices, matrix.data, self._held)
        self._multigrid.update(matrix)
        return self._multigrid.solve


@dataclass
class _Side:
    """One instrument's multipliers: pressure (q,) [Pa], traction (q, 3) [Pa], and normals (q, 3) it is across to."""

    pressure: np.ndarray
    traction: np.ndarray
    normals: np.ndarray

    @staticmethod
    def untouched(count: int) -> "_Side":
        return _Side(np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3)))


class _Contact:
    """The energy of contact and friction in a stage.

    speeds : (3,) [m/s] of each instrument; peak_n : largest norm of the nodal forces so far [N]
    """

    def __init__(self, touch: Touch, sides: list[_Side]):
        self._touch, self._sides, self.peak_n = touch, sides, 0.0
        self.speeds: list[np.ndarray] = []

    def begin(self, poses: list[Pose], x: np.ndarray, tau: float) -> None:
        """Begin a stage of ``tau`` [s] whose velocities are (z − ``x``)/tau, with the instruments where they end."""
        self._poses, self._tau = poses, tau
        self._start = self._touch.points.interpolation @ x

    def _pressure(self, side: _Side, gaps: np.ndarray) -> np.ndarray:
        return np.maximum(side.pressure - self._touch.points.penalty * gaps, 0.0)

    def _trial(self, side: _Side, speed: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Return the traction (q, 3) [Pa] that would keep what is touched from sliding, but for its creep."""
        slid = at - self._start - self._tau * speed
        slid -= (slid * side.normals).sum(axis=1, keepdims=True) * side.normals
        return side.traction - self._touch.points.penalty[:, None] * (slid - self._creep(side))

    def _creep(self, side: _Side) -> np.ndarray:
        """Return by how much points slide in the stage under their traction: the inverse of 2 s − s² = |t| / (μ p)."""
        size = np.linalg.norm(side.traction, axis=1)
        limit = np.maximum(self._touch.friction * side.pressure, 1e-300)
        share = 1.0 - np.sqrt(1.0 - np.minimum(size / limit, 1.0))
        longest = self._touch.slip_m_s * self._tau
        return -(longest * share / np.maximum(size, 1e-300))[:, None] * side.traction

    def _traction(self, side: _Side, speed: np.ndarray, at: np.ndarray) -> np.ndarray:
        trial = self._trial(side, speed, at)
        size, limit = np.linalg.norm(trial, axis=1), self._touch.friction * side.pressure
        return trial * (np.minimum(size, limit) / np.maximum(size, 1e-300))[:, None]

    def energy(self, z: np.ndarray) -> float:
        """Return the energy [J], whose derivatives are the forces."""
        at, k, areas = self._touch.points.interpolation @ z, self._touch.points.penalty, self._touch.points.areas
        whole = 0.0
        for side, pose, speed in zip(self._sides, self._poses, self.speeds, strict=True):
            pressure = self._pressure(side, pose.gaps(at)[0])
            whole += 0.5 * float(areas @ ((pressure**2 - side.pressure**2) / k))
            if self._touch.friction:
                size, limit = np.linalg.norm(self._trial(side, speed, at), axis=1), self._touch.friction * side.pressure
                whole += float(areas @ (np.where(size < limit, 0.5 * size**2, limit * (size - 0.5 * limit)) / k))
        return whole

    def pushes(self, z: np.ndarray) -> list[np.ndarray]:
        """Return the force (q, 3) [N] of each instrument on the points of a body at ``z`` (n, 3) [m]."""
        at, found = self._touch.points.interpolation @ z, []
        for side, pose, speed in zip(self._sides, self._poses, self.speeds, strict=True):
            gaps, normals = pose.gaps(at)
            push = self._pressure(side, gaps)[:, None] * normals
            if self._touch.friction:
                push += self._traction(side, speed, at)
            found.append(self._touch.points.areas[:, None] * push)
        return found

    def total(self, z: np.ndarray) -> np.ndarray:
        """Return the force (q, 3) [N] of all instruments on the points."""
        return np.sum(self.pushes(z), axis=0)

    def rubbed(self, z: np.ndarray) -> float:
        """Return the power [W] that friction takes."""
        if not self._touch.friction:
            return 0.0
        at = self._touch.points.interpolation @ z
        moved, power = (at - self._start) / self._tau, 0.0
        for side, speed in zip(self._sides, self.speeds, strict=True):
            power -= float(self._touch.points.areas @ (self._traction(side, speed, at) * (moved - speed)).sum(axis=1))
        return power

    def renew(self, z: np.ndarray) -> None:
        """Set the multipliers to the pressures and tractions at ``z`` (n, 3) [m]."""
        at = self._touch.points.interpolation @ z
        for side, pose, speed in zip(self._sides, self._poses, self.speeds, strict=True):
            gaps, normals = pose.gaps(at)
            if self._touch.friction:
                traction = self._traction(side, speed, at)
                side.traction = traction - (traction * normals).sum(axis=1, keepdims=True) * normals
            side.pressure, side.normals = self._pressure(side, gaps), normals
            side.traction[side.pressure == 0.0] = 0.0

    def stiffness(self, z: np.ndarray) -> np.ndarray:
        """Return the stiffness (q, 3, 3) [N/m] of points that touch, without what curvature and sliding take off."""
        at, blocks = self._touch.points.interpolation @ z, np.zeros((len(self._start), 3, 3))
        for side, pose in zip(self._sides, self._poses, strict=True):
            gaps, normals = pose.gaps(at)
            on = self._pressure(side, gaps) > 0.0
            blocks[on] += normals[on, :, None] * normals[on, None, :]
            if self._touch.friction:
                stuck = on & (np.linalg.norm(side.traction, axis=1) < 0.99 * self._touch.friction * side.pressure)
                blocks[stuck] += np.eye(3) - normals[stuck, :, None] * normals[stuck, None, :]
        return (self._touch.points.areas * self._touch.points.penalty)[:, None, None] * blocks


class _Stage(OnePass):
    """½ ‖z − x − τ v‖²_M / τ² + E(z) − f·z + ½ ‖z − x‖²_C / τ + contact, whose minimum z ends a stage of τ.

    The damping matrix is that at x + τ v, which differs from z by the order of τ².
    """

    def __init__(self, motion: TouchedMotion, contact: _Contact, x: np.ndarray, v: np.ndarray, tau: float):
        super().__init__()
        self._motion, self._contact, self._x, self._ahead, self._tau = motion, contact, x, x + tau * v, tau
        self.damping = motion.damping(self._ahead)

    def evaluate(self, z: np.ndarray, force: np.ndarray) -> float:
        motion = self._motion
        away, moved = z - self._ahead, z - self._x
        inertia, drag = motion.masses @ away / self._tau**2, self.damping(moved) / self._tau
        pull = motion.force(z) - inertia - drag + motion.spread @ self._contact.total(z)
        force += np.where(motion.held[:, None], 0.0, pull)
        kept = motion.energy(z) + self._contact.energy(z)
        return kept + 0.5 * float(np.vdot(away, inertia)) + 0.5 * float(np.vdot(moved, drag))
