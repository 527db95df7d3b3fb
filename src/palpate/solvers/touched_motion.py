"""Quadratic elements in motion under rigid instruments that press, stroke and lift, with friction.

A step has two stages (SDIRK2; Alexander 1977), each the minimum of an energy as a step of backward Euler is. The rule
is of second order and knows no step before its own, so that corners of an instrument's path cost nothing where steps
end; what is stiff, as contact is, it damps, and the end of a step is in balance. The midpoint rule would leave a point
of the surface that comes to touch within a step as deep inside as it was outside.

Contact acts at points of the surface, whose pressure is k times how deep they are inside. Multipliers that are kept
from step to step would grow for ever where elements cannot follow an instrument at all their points, the more the more
steps there are: the limit of a mesh would not exist.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.effects.elements import OnePass
from palpate.effects.instrument import Pose
from palpate.effects.settings import Loads, Rayleigh
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold
from palpate.solvers.indentation import ContactPoints
from palpate.solvers.lbfgs import minimise_by_lbfgs
from palpate.solvers.quadratic_motion import MORE_ITERATIONS, MOST_ITERATIONS, QuadraticMotion, Reached

STAGE = 1.0 - np.sqrt(0.5)
"""Length of a stage over that of its step."""
STIFFER = 16.0
"""Stiffness k over that of contact at rest, which has multipliers."""
PASSES = 2
"""How often each stage is solved, the second time with the pressures and normals that friction has in the first."""


@dataclass(frozen=True, eq=False)
class Touch:
    """What touches a body: points of its surface, the instruments' poses at a time [s], friction.

    friction : Coulomb's coefficient; slip_m_s : speed [m/s] below which what sticks creeps, as ``contact`` says
    """

    points: ContactPoints
    poses: Callable[[float], list[Pose]]
    friction: float
    slip_m_s: float


class TouchedMotion(QuadraticMotion):
    """A held body of quadratic elements that instruments touch; other arguments and errors as ``QuadraticMotion``.

    bearing, pushed : which points (q,) bore pressure at the end of the last step, and the forces (q, 3) [N] on them
    overlap_j : the energy of contact there [J]
    """

    def __init__(self, body: Body, level: int, loads: Loads, rayleigh: Rayleigh, touch: Touch):
        super().__init__(body, level, loads, rayleigh)
        points = replace(touch.points, penalty=STIFFER * touch.points.penalty)
        self.touch = replace(touch, points=points)
        self.bearing, self.overlap_j = np.zeros(len(points.areas), dtype=bool), 0.0
        self.pushed = np.zeros((len(points.areas), 3))
        self.spread = touch.points.interpolation.T.tocsr()
        absolute = abs(touch.points.interpolation)
        self._lumping, self._lump = absolute.T.tocsr(), absolute.sum(axis=1)

    def touched_steps(self, h: float, count: int, tolerance: float, passes: int = PASSES) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s] from rest.

        tolerance : of the forces that do not balance, over the largest norm that those of contact and loads have had
        passes : how often each stage with friction is solved
        Raises NotConverged for a stage that is not found.
        """
        x, v, tau = self.mesh.nodes.copy(), np.zeros_like(self.mesh.nodes), STAGE * h
        contact, solve = _Contact(self.touch), None
        for number in range(count):
            begin = number * h
            here, there = self.touch.poses(begin), self.touch.poses(begin + h)
            contact.speeds = [(after.tip - before.tip) / h for before, after in zip(here, there, strict=True)]
            base_x, base_v, work, lost, convex = x, v, 0.0, 0.0, True
            mean = np.zeros((len(here), 3))
            for share, ends in ((1.0 - STAGE, begin + tau), (STAGE, begin + h)):
                contact.begin(self.touch.poses(ends), base_x, tau)
                self.load = self.load_at(ends)
                stage, z = _Stage(self, contact, base_x, base_v, tau), base_x + tau * base_v
                z[self.held] = self.mesh.nodes[self.held]
                for _ in range(passes if self.touch.friction else 1):
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
            self.bearing, self.overlap_j, self.pushed = contact.bearing, contact.overlap_energy(z), contact.total(z)
            yield Reached(x, v, x - self.mesh.nodes, work, lost, convex, mean)

    def total_energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the elastic and kinetic energy [J], and that of contact where the last step ended."""
        return super().total_energy(x, v) + self.overlap_j

    def _solver(self, tau: float, x: np.ndarray, contact: "_Contact") -> Callable[[np.ndarray], np.ndarray]:
        """Return a multigrid cycle for what linear elements on the same nodes, at ``x`` (n, 3) [m], make of a stage."""
        assert self._multigrid is not None  # quadratic elements have a level below that of their nodes
        matrix, diagonal = self.linear_stage(tau, x), self._linear.pattern.diagonal
        blocks = self._lump[:, None] * contact.stiffness(x).reshape(-1, 9)
        matrix.data[diagonal] += (self._lumping @ blocks).reshape(-1, 3, 3)
        hold(matrix.indptr, matrix.indices, matrix.data, self._held)
        self._multigrid.update(matrix)
        return self._multigrid.solve


class _Contact:
    """The energy of contact and friction in a stage: of the pressure k max(−g, 0) and of Coulomb's law, smooth at rest.

    Friction has pressures and normals of an earlier state (q,) [Pa], (q, 3), which ``renew`` sets; its potential is
    that of ``collision.contact.friction``.
    speeds : (k, 3) [m/s] of the instruments; peak_n : largest norm of the nodal forces so far [N]
    """

    def __init__(self, touch: Touch):
        self._touch, self.peak_n = touch, 0.0
        self._pressures = [np.zeros(len(touch.points.areas)) for _ in touch.poses(0.0)]
        self._normals = [np.zeros((len(touch.points.areas), 3)) for _ in self._pressures]
        self.speeds: list[np.ndarray] = []
        self._seen: tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray]]] | None = None

    @property
    def bearing(self) -> np.ndarray:
        """Which points (q,) bear pressure."""
        return np.any([pressure > 0.0 for pressure in self._pressures], axis=0)

    def begin(self, poses: list[Pose], x: np.ndarray, tau: float) -> None:
        """Begin a stage of ``tau`` [s] whose velocities are (z − ``x``)/tau, with the instruments where they end."""
        self._poses, self._tau, self._slip = poses, tau, self._touch.slip_m_s * tau
        self._start, self._seen = self._touch.points.interpolation @ x, None

    def _see(self, z: np.ndarray) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """Return the places (q, 3) [m] of points, and their gaps (q,) [m] to each instrument with the gradients (q, 3).

        They are kept, as energy, forces and stiffness ask for those of the same ``z`` (n, 3) [m] one after another.
        """
        if self._seen is None or not np.array_equal(z, self._seen[0]):
            at = self._touch.points.interpolation @ z
            self._seen = z.copy(), at, [pose.gaps(at) for pose in self._poses]
        return self._seen[1:]

    def _slides(self, at: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield for each instrument how far points slide along it (q, 3) [m], the length, and μ p (q,) [Pa]."""
        for pressure, normals, speed in zip(self._pressures, self._normals, self.speeds, strict=True):
            slid = at - self._start - self._tau * speed
            slid -= (slid * normals).sum(axis=1, keepdims=True) * normals
            yield slid, np.linalg.norm(slid, axis=1), self._touch.friction * pressure

    def _resistance(self, length: np.ndarray) -> np.ndarray:
        """Return the derivative of friction's potential over the length (q,) [1/m], for μ p = 1."""
        slip = self._slip
        return np.where(length < slip, (2.0 - length / slip) / slip, 1.0 / np.maximum(length, slip))

    def overlap_energy(self, z: np.ndarray) -> float:
        """Return the energy [J] of what overlaps of a body at ``z`` (n, 3) [m]."""
        stiff = self._touch.points.areas * self._touch.points.penalty
        return sum(0.5 * float(stiff @ np.maximum(-gaps, 0.0) ** 2) for gaps, _ in self._see(z)[1])

    def energy(self, z: np.ndarray) -> float:
        """Return the energy [J], whose derivatives are the forces."""
        areas, slip, whole = self._touch.points.areas, self._slip, self.overlap_energy(z)
        for _, length, limit in self._slides(self._see(z)[0]) if self._touch.friction else ():
            creeping = length**2 / slip * (1.0 - length / (3.0 * slip))
            whole += float(areas @ (limit * np.where(length < slip, creeping, length - slip / 3.0)))
        return whole

    def pushes(self, z: np.ndarray) -> list[np.ndarray]:
        """Return the force (q, 3) [N] of each instrument on the points of a body at ``z`` (n, 3) [m]."""
        at, seen = self._see(z)
        found = [(self._touch.points.penalty * np.maximum(-gaps, 0.0))[:, None] * normals for gaps, normals in seen]
        if self._touch.friction:
            for push, (slid, length, limit) in zip(found, self._slides(at), strict=True):
                push -= (limit * self._resistance(length))[:, None] * slid
        return [self._touch.points.areas[:, None] * push for push in found]

    def total(self, z: np.ndarray) -> np.ndarray:
        """Return the force (q, 3) [N] of all instruments on the points."""
        return np.sum(self.pushes(z), axis=0)

    def rubbed(self, z: np.ndarray) -> float:
        """Return the power [W] that friction takes."""
        areas = self._touch.points.areas
        slides = self._slides(self._see(z)[0]) if self._touch.friction else ()
        return sum(float(areas @ (limit * self._resistance(u) * u**2)) for _, u, limit in slides) / self._tau

    def renew(self, z: np.ndarray) -> None:
        """Take the pressures and normals at ``z`` (n, 3) [m] for those of friction."""
        for number, (gaps, normals) in enumerate(self._see(z)[1]):
            self._normals[number] = normals
            self._pressures[number] = self._touch.points.penalty * np.maximum(-gaps, 0.0)

    def stiffness(self, z: np.ndarray) -> np.ndarray:
        """Return the stiffness (q, 3, 3) [N/m] of the points, without what curvature and sliding take off."""
        (at, seen), blocks = self._see(z), np.zeros((len(self._start), 3, 3))
        for gaps, normals in seen:
            pressed = np.where(gaps < 0.0, self._touch.points.penalty, 0.0)
            blocks += pressed[:, None, None] * normals[:, :, None] * normals[:, None, :]
        if self._touch.friction:
            for normals, (_, length, limit) in zip(self._normals, self._slides(at), strict=True):
                across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
                blocks += (limit * self._resistance(length))[:, None, None] * across
        return self._touch.points.areas[:, None, None] * blocks


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
