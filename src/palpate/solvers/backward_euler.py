"""Backward Euler: each step is a minimisation. It is stable for any step and never creates energy."""

import math
from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.effects.effect import Damping, Energy, Force, Stiffness, is_load, offers
from palpate.effects.settings import Stepping
from palpate.errors import InputError, NotConverged
from palpate.linalg.minimiser import Product, minimise_by_newton
from palpate.linalg.multigrid import Factor
from palpate.solvers.incremental_potential import IncrementalPotential
from palpate.solvers.system import System

HALVINGS = 8
"""Number of times that a step is halved, if Newton's method does not converge, before giving up."""
MOST_CONTACT = 1e-3
"""Most that a contact force counts in the scale of residuals, over the force that would flatten the body: close to an
obstacle that has just moved, contact forces can be extremely large."""
MAX_PRODUCTS = 30
"""Products with the matrix in a search after which a new factor is made as its preconditioner."""


def make(system: System, stepping: Stepping) -> "BackwardEuler":
    """Make the integrator; InputError for an effect whose force it could not include in the minimisation."""
    check(system)
    return BackwardEuler(system, stepping.tolerance)


def check(system: System) -> None:
    """Raise InputError for an effect whose force is in no minimisation."""
    if not offers(system.elastic, Stiffness):
        raise InputError("it needs an elastic effect with a stiffness; with shape_matching choose goal_position.")
    for name, effect in system.offering(Force):
        if not (offers(effect, Energy) or offers(effect, Damping) or is_load(effect)):
            raise InputError(
                f"{name} has a force, but no energy, no add_damping and not outer = True, so it would be ignored; "
                "give it one of them."
            )


class BackwardEuler:
    """A step: x' of least ‖x' − x − h v‖²_M / 2h² + E(x') − f·x' + (x' − x)ᵀ C(x) (x' − x) / 2h, v' = (x' − x)/h.

    E is the potential energy, f the loads and C the damping matrix at the start of the step (Martin et al. 2011; Gast
    et al. 2015). The minimum is not above the value at x, so the potential energy never exceeds the total energy
    before, plus the work of the loads. Where E is not convex, its sum with the kinetic energy may; then v' is scaled
    down until the sum does not exceed it, and keeps its mean. So no step creates energy.
    """

    limit_s = math.inf

    def __init__(self, system: System, tolerance: float):
        self._system, self._tolerance = system, tolerance
        self.renew()
        rest = system.stiffness(system.particles.nodes, definite=True)
        assert rest is not None  # ``make`` requires an elastic effect with a stiffness
        # a force [N] of the order that would flatten the body
        self._crushing = float(np.linalg.norm(rest.data[system.pattern.diagonal])) * system.particles.size
        self._factored_step, self._products = 0.0, 0

    def renew(self) -> None:
        """Take the masses that the system has now, and make the next factor anew."""
        self._masses = self._system.masses[:, None]
        self._factor: Factor | None = None

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        return self._advance(x, v, h, HALVINGS)

    def _advance(self, x: np.ndarray, v: np.ndarray, h: float, halvings: int) -> tuple[np.ndarray, np.ndarray]:
        """Take a step of ``h`` [s], or two of half of it where none is found, with up to so many ``halvings``."""
        try:
            # an obstacle that moves into the body does work: it displaces nodes, at a speed and against their forces
            carried = self._system.begin(x, h)
            energy_before = self._kinetic(v) + self._kinetic((carried - x) / h) + self._system.energy(carried)
            reached, load = self.least(x, v, h, carried, x)
        except NotConverged as failure:
            if not halvings:
                raise NotConverged(f"a step of {h:.1e} s: {failure}", failure.history) from failure
            end = self._system.time
            for time in (end - h / 2, end):
                self._system.at(time)
                x, v = self._advance(x, v, h / 2, halvings - 1)
            return x, v
        velocity = (reached - x) / h
        self._system.add_work(load, reached - x)
        self._system.end(reached)
        allowed = energy_before + float(np.vdot(load, reached - x)) - self._system.energy(reached)
        return reached, self._scaled_down(velocity, allowed)

    def least(
        self, x: np.ndarray, v: np.ndarray, h: float, carried: np.ndarray, seen: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, 3) [m] at the minimum of one step, and the loads (n, 3) [N] in it.

        x, v, h : positions and velocities at the start of the step, and its length [s]
        carried : positions (n, 3) [m] at which ``System.begin`` starts, where the search may begin
        seen : positions (n, 3) [m] whose damping matrix and loads act throughout the step
        """
        step = _Step(self, x, v, h, carried, seen)
        return minimise_by_newton(step, step.start(), step.scale(self._crushing), self._tolerance).x, step.load

    def _scaled_down(self, v: np.ndarray, allowed: float) -> np.ndarray:
        """Return ``v`` with a kinetic energy of at most ``allowed`` [J] and, if no node is held, the same momentum."""
        kinetic = self._kinetic(v)
        if kinetic <= allowed:
            return v
        mean = np.zeros(3)
        if self._system.free.all():
            mean = (self._masses * v).sum(axis=0) / self._masses.sum()
        relative = v - mean
        mean_energy = 0.5 * float(self._masses.sum()) * float(mean @ mean)
        ratio = max(0.0, allowed - mean_energy) / max(self._kinetic(relative), 1e-300)
        return mean + math.sqrt(min(1.0, ratio)) * relative

    def _kinetic(self, v: np.ndarray) -> float:
        return 0.5 * float(np.vdot(self._masses * v, v))

    def precondition(self, matrix: Callable[[], sparse.bsr_array], h: float) -> Product:
        """Return the solution with the factor of an earlier matrix, or with that of a new one, which ``matrix`` makes.

        A new one is made for another step ``h`` [s], and where the last search took many products.
        """
        if self._factor is None or self._factored_step != h or self._products > MAX_PRODUCTS:
            self._factor, self._factored_step = Factor(matrix()), h
        self._products = 0
        return self._factor.solve

    def multiply(self, matrix: sparse.bsr_array) -> Product:
        """Return the product with ``matrix``, which counts its calls."""

        def product(p: np.ndarray) -> np.ndarray:
            self._products += 1
            return (matrix @ p.ravel()).reshape(p.shape)

        return product


class _Step(IncrementalPotential):
    """The incremental potential of one step as a ``minimiser.Problem``; its energy and forces include loads."""

    def __init__(
        self, integrator: BackwardEuler, x: np.ndarray, v: np.ndarray, h: float, carried: np.ndarray, seen: np.ndarray
    ):
        self._integrator, self._system = integrator, integrator._system
        self._carried, self._h, self._weights = carried, h, integrator._masses / h**2
        system, load = integrator._system, integrator._system.outer_force(seen, v)
        self._damping = damping = system.damping(seen)
        self.load = load
        super().__init__(
            x,
            x + h * np.where(system.free[:, None], v, 0.0),
            ~system.free,
            (
                lambda z: system.energy(z) - float(np.vdot(load, z - x)),
                lambda z: system.potential_force(z) + load,
            ),
            lambda away: self._weights * away,
            None if damping is None else lambda moved: (damping @ moved.ravel()).reshape(moved.shape) / h,
        )
        if self._system.bounded:
            self.limit = self._system.limit

    def start(self) -> np.ndarray:
        """Return the positions (n, 3) [m] at which the search begins: those of less energy of two.

        One are those at the start of the step, the other its inertial prediction, or the last positions that are
        allowed on the way there where an effect limits steps.
        """
        ahead = self.ahead
        if self._system.bounded:
            motion = ahead - self._carried
            ahead = self._carried + self._system.limit(self._carried, motion) * motion
        return min((self._carried, ahead), key=self.energy)

    def scale(self, crushing: float) -> float:
        """Return the scale of residuals [N]: of inertia and of all effects, at least 1e-6 of ``crushing`` [N]."""
        inertia = float(np.linalg.norm(self._weights * (self.ahead - self.x)))
        return inertia + self._system.magnitude(self._carried, MOST_CONTACT * crushing) + 1e-6 * crushing

    def linearise(self, z: np.ndarray, definite: bool) -> tuple[Product, Product]:
        matrix = self._matrix(z, definite)
        precondition = self._integrator.precondition(
            lambda: matrix if definite else self._matrix(z, definite=True), self._h
        )
        return self._integrator.multiply(matrix), precondition

    def _matrix(self, z: np.ndarray, definite: bool) -> sparse.bsr_array:
        """Return the Hessian (3n, 3n) [N/m] of the potential at ``z`` (n, 3) [m], clamped if ``definite``."""
        matrix = self._system.stiffness(z, definite)
        assert matrix is not None
        matrix.data[self._system.pattern.diagonal] += self._weights[:, :, None] * np.eye(3)
        if self._damping is not None:
            matrix.data += self._damping.data / self._h
        touching = self._system.touching(z, definite)
        if touching is not None:
            matrix = matrix + touching
        self._system.hold(matrix)
        return matrix
