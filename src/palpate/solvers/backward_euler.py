"""Backward Euler: each step a minimisation, unconditionally stable, and without energy from nowhere."""

import math
from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.errors import InputError, NotConverged
from palpate.linalg.factor import Factor
from palpate.solvers.newton import minimise
from palpate.solvers.system import System

HALVINGS = 8
"""How often a step that Newton's method does not manage is cut in two before giving up."""
FIRM = 1e-3
"""Up to what part of the force that would press a body to nothing the forces of contact count among those that
residuals are measured by: near a surface that has just been moved they may be beyond any sense."""
PATIENCE = 30
"""Products with the matrix after which its old factor no longer pays as a preconditioner."""


def make(system: System, settings: dict) -> "BackwardEuler":
    """The integrator; InputError where an effect has a force that comes from nothing it could minimise."""
    if not hasattr(system.elastic, "add_stiffness"):
        raise InputError("it needs an elastic effect with a stiffness; with shape_matching choose goal_position.")
    for name, effect in system.offering("add_force"):
        if not (hasattr(effect, "energy") or hasattr(effect, "add_damping") or getattr(effect, "outer", False)):
            raise InputError(
                f"{name} has a force, but no energy, no add_damping and not outer = True, so it would be missed; "
                "give it one of them."
            )
    return BackwardEuler(system, settings["tolerance"])


class BackwardEuler:
    """x' minimises ‖x' − x − h v‖²_M / 2h² + E(x') − f·x' + (x' − x)ᵀ C(x) (x' − x) / 2h, then v' = (x' − x)/h.

    E is the potential energy, f the loads and C the damping matrix, taken at the start of the step (Martin et al.
    2011; Gast et al. 2015). As the minimum is not above the value at x, the potential energy never exceeds the
    energy there was, plus the work of the loads; yet together with the kinetic energy it may, where E is not
    convex. Then v' is scaled down until the sum fits, its mean left alone: no step makes energy.
    """

    limit_s = math.inf

    def __init__(self, system: System, tolerance: float):
        self._system, self._tolerance = system, tolerance
        self._masses = system.masses[:, None]
        rest = system.stiffness(system.particles.nodes, definite=True)
        self._stiff = float(np.linalg.norm(rest.data[system.pattern.diagonal])) * system.particles.size
        self._factor, self._factored, self._products = None, None, 0

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; NotConverged if none is found."""
        return self._advance(x, v, h, HALVINGS)

    def _advance(self, x, v, h, halvings):
        try:
            # what drives into the body does work on it: it carries nodes along, at a speed and against their forces
            carried = self._system.begin(x, h)
            before = self._kinetic(v) + self._kinetic((carried - x) / h) + self._system.energy(carried)
            step = (_BoundedStep if self._system.bounded else _Step)(self, x, v, h, carried)
            reached = minimise(step, step.start(), step.scale(self._stiff), self._tolerance).x
        except NotConverged as failure:
            if not halvings:
                raise NotConverged(f"a step of {h:.1e} s: {failure}", failure.history) from failure
            return self._in_two(x, v, h / 2, halvings - 1)
        velocity = (reached - x) / h
        allowed = before + float(np.vdot(step.load, reached - x)) - self._system.energy(reached)
        return reached, self._calm(velocity, allowed)

    def _in_two(self, x, v, half, halvings):
        end = self._system.time
        self._system.at(end - half)
        x, v = self._advance(x, v, half, halvings)
        self._system.at(end)
        return self._advance(x, v, half, halvings)

    def _calm(self, v: np.ndarray, allowed: float) -> np.ndarray:
        """``v`` with a kinetic energy of ``allowed`` [J] at most; where nothing is held its mean stays."""
        kinetic = self._kinetic(v)
        if kinetic <= allowed:
            return v
        mean = np.zeros(3)
        if self._system.free.all():
            mean = (self._masses * v).sum(axis=0) / self._masses.sum()
        inner = v - mean
        common = 0.5 * float(self._masses.sum()) * float(mean @ mean)
        spare = max(0.0, allowed - common) / max(self._kinetic(inner), 1e-300)
        return mean + math.sqrt(min(1.0, spare)) * inner

    def _kinetic(self, v: np.ndarray) -> float:
        return 0.5 * float(np.vdot(self._masses * v, v))

    def precondition(self, matrix: Callable, h: float) -> Callable[[np.ndarray], np.ndarray]:
        """Solve with the factor of an earlier matrix as long as that takes few products."""
        if self._factored != h or self._products > PATIENCE:
            self._factor, self._factored = Factor(matrix()), h
        self._products = 0
        return self._factor.solve

    def multiply(self, matrix) -> Callable[[np.ndarray], np.ndarray]:
        """Products with ``matrix``, counted."""

        def product(p: np.ndarray) -> np.ndarray:
            self._products += 1
            return (matrix @ p.ravel()).reshape(p.shape)

        return product


class _Step:
    """The minimisation of one step, as Newton's method wants it."""

    def __init__(self, integrator: BackwardEuler, x: np.ndarray, v: np.ndarray, h: float, carried: np.ndarray):
        self._integrator, self._system = integrator, integrator._system
        self._x, self._carried, self._h, self._inertia = x, carried, h, integrator._masses / h**2
        self._free = self._system.free[:, None]
        self._predicted = x + h * np.where(self._free, v, 0.0)
        self._damping = self._system.damping(x)
        self.load = self._system.outer_force(x, v)

    def start(self) -> np.ndarray:
        """Where the step begins or where inertia leads, whichever is lower."""
        return min((self._carried, self._predicted), key=self.energy)

    def scale(self, stiff: float) -> float:
        """The forces [N] that residuals are measured by; not below what rounding makes of a body's stiffness."""
        inertia = self._inertia * (self._predicted - self._x)
        return float(np.linalg.norm(inertia)) + self._system.magnitude(self._carried, FIRM * stiff) + 1e-6 * stiff

    def energy(self, z: np.ndarray) -> float:
        away, moved = z - self._predicted, z - self._x
        total = 0.5 * float(np.vdot(self._inertia * away, away)) + self._system.energy(z)
        if self._damping is not None:
            total += 0.5 / self._h * float(moved.ravel() @ (self._damping @ moved.ravel()))
        return total - float(np.vdot(self.load, moved))

    def force(self, z: np.ndarray) -> np.ndarray:
        force = self._system.potential_force(z) + self.load - self._inertia * (z - self._predicted)
        if self._damping is not None:
            force -= (self._damping @ (z - self._x).ravel()).reshape(z.shape) / self._h
        return np.where(self._free, force, 0.0)

    def linearise(self, z: np.ndarray, definite: bool) -> tuple[Callable, Callable]:
        matrix = self._matrix(z, definite)
        precondition = self._integrator.precondition(
            lambda: matrix if definite else self._matrix(z, definite=True), self._h
        )
        return self._integrator.multiply(matrix), precondition

    def _matrix(self, z: np.ndarray, definite: bool) -> sparse.bsr_array:
        matrix = self._system.stiffness(z, definite)
        matrix.data[self._system.pattern.diagonal] += self._inertia[:, :, None] * np.eye(3)
        if self._damping is not None:
            matrix.data += self._damping.data / self._h
        touching = self._system.touching(z, definite)
        if touching is not None:
            matrix = matrix + touching
        self._system.hold(matrix)
        return matrix


class _BoundedStep(_Step):
    """One that must not lead through anything."""

    def start(self) -> np.ndarray:
        """As far as the way leads from where the step begins to where inertia does, or its beginning if lower."""
        ahead = self._predicted - self._carried
        reached = self._carried + self._system.limit(self._carried, ahead) * ahead
        return min((self._carried, reached), key=self.energy)

    def limit(self, z: np.ndarray, direction: np.ndarray) -> float:
        return self._system.limit(z, direction)
