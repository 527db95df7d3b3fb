"""Quadratic elements in motion under rigid instruments that press, stroke and lift, with friction.

A step has two stages (SDIRK2; Alexander 1977), each the minimum of an energy as a step of backward Euler is. The rule
is of second order, and uses no earlier step, so that a corner of an instrument's path between two steps costs no
accuracy. It damps what is stiff, as contact is, and forces balance at the end of a step. The midpoint rule would leave
a point that comes to touch within a step as deep inside the instrument as it was outside before.

Contact acts at points of the surface, with a pressure of k times their depth inside the instrument. There are no
multipliers as in ``indentation``: elements cannot take the shape of an instrument at all their points, so that kept
multipliers would grow with every step, and answers would not converge as steps are refined.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from palpate.bodies.body import Body
from palpate.collision.contact.instrument_contact import InstrumentContact, pushes, rubbing_of, stiffness
from palpate.effects.instrument import Tools, gaps_of
from palpate.effects.settings import Loads, Rayleigh
from palpate.linalg.minimiser import Product
from palpate.solvers.incremental_potential import Descents
from palpate.solvers.indentation import ContactPoints
from palpate.solvers.quadratic_motion import QuadraticMotion, Reached

STAGE = 1.0 - np.sqrt(0.5)
"""Length of a stage over that of its step."""
STIFFER = 16.0
"""Stiffness k over the penalty of contact at rest, which has multipliers."""
PASSES = 2
"""How often each stage is solved: friction takes its pressures and normals from the solution before."""


class TouchedMotion(QuadraticMotion):
    """A held body of quadratic elements that instruments touch; other arguments and errors as ``QuadraticMotion``.

    bearing : which points (q,) were under pressure at the end of the last step; overlap_j : the energy of contact [J]
    """

    def __init__(
        self,
        body: Body,
        level: int,
        loads: Loads,
        rayleigh: Rayleigh,
        points: ContactPoints,
        contact: InstrumentContact,
    ):
        super().__init__(body, level, loads, rayleigh)
        self.points, self.contact = points, contact
        self.bearing, self.overlap_j = np.zeros(len(points.areas), dtype=bool), 0.0

    def touched_steps(self, h: float, count: int, tolerance: float, passes: int = PASSES) -> Iterator[Reached]:
        """Yield the ends of ``count`` steps of ``h`` [s] from rest, each of two implicit stages of STAGE ``h``.

        tolerance : of the forces that do not balance, over the largest norm that those of contact and loads have had
        passes : how often each stage with friction is solved
        Raises NotConverged for a stage that is not found.
        """
        x, v, tau = self.mesh.nodes.copy(), np.zeros_like(self.mesh.nodes), STAGE * h
        contact, descents = _Contact(self.points, self.contact), Descents()

        def energy(z: np.ndarray) -> float:
            return self.energy(z) + contact.energy(z)

        def force(z: np.ndarray) -> np.ndarray:
            return self.force(z) + self.points.spread @ contact.total(z)

        for number in range(count):
            begin = number * h
            contact.speeds = (self.contact.at(begin + h).tips - self.contact.at(begin).tips) / h
            from_x, from_v, work, damped, convex = x, v, 0.0, 0.0, True
            mean_force = np.zeros_like(contact.speeds)
            for weight, end in ((1.0 - STAGE, begin + tau), (STAGE, begin + h)):
                contact.begin(end, from_x, tau)
                self.load = self.load_at(end)
                z = from_x + tau * from_v
                damping = self.damping(z)
                stage = self.stage((energy, force), from_x, from_v, tau, damping)
                z[self.held] = self.mesh.nodes[self.held]
                for _ in range(passes if self.contact.friction else 1):
                    self.scale_n = max(self.scale_n, contact.peak_n)
                    scale = max(self.scale_n, contact.norm(z))
                    tolerance_n = max(tolerance * scale, self._rounding)
                    solver = partial(self._solver, tau, z, contact)
                    descent = descents.minimum(stage, z, tolerance_n, solver, f"the stage to {end:.4g} s")
                    z, convex = descent.x, convex and descent.convex
                    contact.renew(z)
                contact.peak_n = max(contact.peak_n, contact.norm(z))
                velocity = (z - from_x) / tau
                forces_now = contact.forces(z).sum(axis=1)
                mean_force += weight * forces_now
                power = float(np.vdot(forces_now, contact.speeds))
                work += weight * h * (float(np.vdot(self.load, velocity)) + power)
                damped += weight * h * (float(np.vdot(velocity, damping(velocity))) + contact.rubbed(z))
                rate = (velocity - from_v) / tau
                from_x, from_v = x + (1.0 - STAGE) * h * velocity, v + (1.0 - STAGE) * h * rate
            x, v = z, velocity
            self.bearing, self.overlap_j = contact.overlap(z)
            yield Reached(x, v, x - self.mesh.nodes, work, damped, convex, mean_force)

    def total_energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the elastic and kinetic energy [J], and that of contact where the last step ended."""
        return super().total_energy(x, v) + self.overlap_j

    def _solver(self, tau: float, x: np.ndarray, contact: "_Contact") -> Product:
        """Return a multigrid cycle for a stage of ``tau`` [s] at ``x`` (n, 3) [m], with contact lumped at nodes."""
        return self.cycle(tau, x, self.points.lumped(np.arange(len(self.points.areas)), contact.stiffness(x)))


class _Contact:
    """The energy and forces of contact and friction in a stage.

    Friction has the pressures and normals of an earlier state, which ``renew`` sets; before the first one it is zero.
    speeds : (k, 3) [m/s] of the instruments; peak_n : largest norm of the nodal forces so far [N]
    """

    def __init__(self, points: ContactPoints, contact: InstrumentContact):
        self._points, self._contact = points, contact
        self._penalty, self._areas, self.peak_n = STIFFER * points.penalty, points.areas, 0.0
        self._earlier: tuple[np.ndarray, Tools] | None = None
        self.speeds = np.empty((0, 3))
        self._seen: tuple[np.ndarray, np.ndarray, np.ndarray, float] | None = None

    def begin(self, end: float, x: np.ndarray, tau: float) -> None:
        """Begin a stage of ``tau`` [s] to ``end`` [s] whose velocities are (z − ``x``)/tau."""
        self._tools, self._tau, self._start = self._contact.at(end), tau, self._points.interpolation @ x
        self._rub()

    def renew(self, z: np.ndarray) -> None:
        """Let friction have the pressures and normals at ``z`` (n, 3) [m]."""
        self._earlier = self._points.interpolation @ z, self._tools
        self._rub()

    def _rub(self) -> None:
        at, tools = self._earlier or (self._start, self._tools)
        friction = self._contact.friction if self._earlier else 0.0
        past = self._start, self._tau * self.speeds, self._contact.slip_m_s * self._tau
        self._rubbing, self._seen = rubbing_of(at, self._penalty, tools, friction, *past), None

    def _see(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the places (q, 3) [m] of points, each instrument's forces (k, q, 3) [N] on them, and the energy [J].

        Those of the last ``z`` (n, 3) [m] are kept: a search asks for energy, forces and stiffness at the same one.
        """
        if self._seen is None or not np.array_equal(z, self._seen[0]):
            places = self._points.interpolation @ z
            pressures, energies = pushes(places, self._penalty, self._tools, self._rubbing)
            self._seen = z.copy(), places, self._areas[:, None] * pressures, float(self._areas @ energies)
        return self._seen[1:]

    def energy(self, z: np.ndarray) -> float:
        """Return the energy [J], whose derivatives are the forces."""
        return self._see(z)[2]

    def forces(self, z: np.ndarray) -> np.ndarray:
        """Return the force (k, q, 3) [N] of each instrument on the points of a body at ``z`` (n, 3) [m]."""
        return self._see(z)[1]

    def total(self, z: np.ndarray) -> np.ndarray:
        """Return the force (q, 3) [N] of all instruments on the points."""
        return self.forces(z).sum(axis=0)

    def norm(self, z: np.ndarray) -> float:
        """Return the norm of the nodal forces [N]."""
        return float(np.linalg.norm(self._points.spread @ self.total(z)))

    def overlap(self, z: np.ndarray) -> tuple[np.ndarray, float]:
        """Return which points (q,) are inside instruments, and the energy [J] of their overlap, without friction."""
        deep = np.minimum(gaps_of(self._see(z)[0], self._tools)[0], 0.0)
        return (deep < 0.0).any(axis=0), 0.5 * float(np.sum(self._areas * self._penalty * deep**2))

    def rubbed(self, z: np.ndarray) -> float:
        """Return the power [W] that friction dissipates."""
        at = self._see(z)[0]
        drags, _ = pushes(at, np.zeros_like(self._areas), self._tools, self._rubbing)
        slid = at - self._start - self._tau * self.speeds[:, None]
        return -float(np.sum(self._areas[:, None] * drags * slid)) / self._tau

    def stiffness(self, z: np.ndarray) -> np.ndarray:
        """Return the stiffness (q, 3, 3) [N/m] of the points, without the negative terms of curvature and sliding."""
        every = np.arange(len(self._areas))
        blocks = stiffness(self._see(z)[0], self._penalty, self._tools, self._rubbing, every)
        return self._areas[:, None, None] * blocks
