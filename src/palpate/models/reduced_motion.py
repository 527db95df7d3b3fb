"""Integrate a reduced motion: BDF2 in the few coordinates of vibration and contact modes, each step by BFGS."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.effects.effect import FixedNodes, Proportional, Weight, is_load, offers
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError, NotConverged
from palpate.models.reduced_body import ReducedBody
from palpate.solvers.system import System

Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""A function of coordinates (r,) and its gradient (r,)."""
SHORTEST_STEP = 1e-6
"""A step that is cut below this part of its length is none."""
VALUE_ROUNDING = 1e-14
"""Relative rounding of the function, beside what the caller knows of it."""


class CarriedBfgs:
    """BFGS with a full inverse Hessian (r, r), carried from each minimum to the next (Nocedal and Wright 2006, 6.1).

    first : (r,), the inverse of a diagonal Hessian; the search begins with it, and again where the carried one fails
    """

    def __init__(self, first: np.ndarray):
        self._first = np.diag(first)
        self._inverse = self._first.copy()

    def minimise(
        self, evaluate: Evaluate, q: np.ndarray, enough: float, noise: float, iterations: int
    ) -> tuple[np.ndarray, float]:
        """Return coordinates (r,) from ``q`` on, and the norm of the gradient there.

        The norm is at most ``enough``, or 0 where what is left to gain is below the function's rounding, ``noise``; it
        is more where ``iterations`` did not suffice or no step descends.
        """
        value, gradient = evaluate(q)
        for _ in range(iterations):
            norm = float(np.linalg.norm(gradient))
            if norm <= enough:
                return q, norm
            found = self._search(evaluate, q, value, gradient, noise)
            if found is None:
                if float(gradient @ self._first @ gradient) <= noise + VALUE_ROUNDING * abs(value):
                    return q, 0.0
                if np.array_equal(self._inverse, self._first):
                    break
                self._inverse = self._first.copy()
                continue
            step, value, ahead = found
            self._learn(step, ahead - gradient)
            q, gradient = q + step, ahead
        return q, float(np.linalg.norm(gradient))

    def _search(
        self, evaluate: Evaluate, q: np.ndarray, value: float, gradient: np.ndarray, noise: float
    ) -> tuple[np.ndarray, float, np.ndarray] | None:
        """Find the first of the steps 1, ½, ¼ … that descends enough (Armijo), the value there, and the gradient."""
        ahead = -(self._inverse @ gradient)
        slope, length = float(gradient @ ahead), 1.0
        if not slope < 0.0:
            return None
        while length > SHORTEST_STEP:
            reached, there = evaluate(q + length * ahead)
            if reached <= value + 1e-4 * length * slope + noise + VALUE_ROUNDING * abs(value):
                return length * ahead, reached, there
            length *= 0.5
        return None

    def _learn(self, step: np.ndarray, bend: np.ndarray) -> None:
        """Update the inverse Hessian by how a step bent the gradient; not where the function is not convex."""
        product = float(step @ bend)
        if product <= 1e-12 * float(np.linalg.norm(step) * np.linalg.norm(bend)):
            return
        turned = self._inverse @ bend
        mixed = np.outer(step, turned)
        scale = (1.0 + float(bend @ turned) / product) / product
        self._inverse += scale * np.outer(step, step) - (mixed + mixed.T) / product


ITERATIONS = 60
"""Of BFGS in a step, after which it counts as not found."""
LEAST_SCALE = 1e-6
"""Lower bound of the scale of residuals, in forces that would flatten the body."""
STRAIN_ROUNDING = 1e-15
"""Of a deformation gradient."""
LEAST_DET = 0.6
"""Smallest det F of a cell that is believed: below, elements of it may be flat or inverted."""


def make(system: System, settings: dict) -> "ReducedMotion":
    """Make the integrator with the modes that ``settings["reduced"]`` describes (see ReducedBody).

    InputError for an effect that it does not know, and for a body that nothing holds.
    """
    if not isinstance(system.elastic, LinearElements):
        raise InputError("it needs finite elements, as vibration modes are theirs; choose another integrator.")
    for name, effect in list(system.effects.items())[1:]:
        supported = (
            offers(effect, FixedNodes) or offers(effect, Weight) or is_load(effect) or offers(effect, Proportional)
        )
        if not supported:
            raise InputError(
                f"it has modes for weight, pushes, anchors and damping in proportion to mass and stiffness alone, and "
                f"the scene has {name}; leave that out, or choose bdf2."
            )
    return ReducedMotion(system, ReducedBody.of(system, settings["reduced"]), settings["tolerance"])


class _State(NamedTuple):
    """Coordinates q (r,), their rates w (r,) [1/s] and the elastic energy's gradient g (r,) at the end of a step."""

    q: np.ndarray
    w: np.ndarray
    g: np.ndarray


class ReducedMotion:
    """M q″ + d (α M q + β g(q))/dt + g(q) = f by BDF2, in coordinates q of modes in which M and K are diagonal.

    α, β : of damping in proportion to mass and stiffness; the latter is taken as the rate of change of the elastic
    force g, whose derivative is K(q) q̇, so that it turns with the body and needs no matrix.
    Each step is a minimisation by BFGS, which keeps its Hessian from step to step; the first step is that of backward
    Euler. NotConverged where one is not found, or where a cell is squeezed to det F < LEAST_DET.

    Trap: nothing is known of motions that the modes do not have; a push elsewhere than at their places is answered by
    vibration modes only. And as BDF2 it may make energy (see ``solvers/bdf2.py``).
    """

    limit_s = math.inf

    def __init__(self, system: System, body: ReducedBody, tolerance: float):
        self._system, self.body, self._tolerance = system, body, tolerance
        rates = [effect.damping_rates for _, effect in system.offering(Proportional)]
        self._alpha, self._beta = (sum(each[k] for each in rates) for k in (0, 1))
        self._weight = body.project(system.potential_force(system.particles.nodes))
        self._now = self._before = self._at(np.zeros(body.count), np.zeros(body.count))
        self._length = 0.0
        self._search: CarriedBfgs | None = None
        # the force of the softest mode when it moves a node as far as the body is long
        self.flattening = float(system.particles.size / np.abs(body.modes).max())
        self._reached = system.particles.nodes, np.zeros_like(system.particles.nodes)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s].

        Raises NotConverged if it is not found; InputError for a state that is not that of its last step or rest.
        """
        if not (np.array_equal(x, self._reached[0]) and np.array_equal(v, self._reached[1])):
            raise InputError("it begins at rest, in the rest shape, and goes on from its own steps; say start: rest.")
        load = self._system.outer_force(x, v)
        push = self.body.project(load) + self._weight
        second = self._length == h
        now, before = self._now, self._before if second else self._now
        share, reach = (1.0 / 3.0, 2.0 * h / 3.0) if second else (0.0, h)
        base, rate, pull = (a + share * (a - b) for a, b in zip(now, before, strict=True))
        problem = _Step(self, base, rate, reach, pull, push)
        if not second or self._search is None:
            self._search = CarriedBfgs(1.0 / problem.at_rest)
        q = self._found(problem, self._search, 2.0 * now.q - before.q)
        self._before, self._now, self._length = now, self._at(q, (q - base) / reach), h
        reached = self._system.particles.nodes + self.body.expand(q)
        self._system.add_work(load, reached - x)
        self._reached = reached, self.body.expand(self._now.w)
        return self._reached

    def _at(self, q: np.ndarray, w: np.ndarray) -> _State:
        return _State(q, w, self.body.cells.evaluate(q)[1])

    def _found(self, problem: "_Step", search: CarriedBfgs, start: np.ndarray) -> np.ndarray:
        """Return the coordinates (r,) at the end of a step; NotConverged if they are not found."""
        q, gradient_norm = search.minimise(
            problem.evaluate, start, self._tolerance * problem.scale, problem.noise, ITERATIONS
        )
        residual = gradient_norm / problem.scale
        if not residual <= self._tolerance:
            raise NotConverged(
                f"the reduced motion stopped at a residual {residual:.1e} of its forces, above the tolerance "
                f"{self._tolerance:.0e}; take shorter steps",
                [residual],
            )
        least_det = self.body.cells.least_det(q)
        if least_det < LEAST_DET:
            raise NotConverged(
                f"a cell of the reduced body keeps {least_det:.2g} of its volume, and modes are not to be believed "
                f"below {LEAST_DET:g}; lower the load, or choose bdf2",
                [residual],
            )
        return q


class _Step:
    """The minimisation of one step from ``base`` at ``rate`` over ``reach`` [s]; ``pull`` is g there, ``push`` f.

    at_rest : (r,), the diagonal Hessian at rest; scale : of residuals: loads, elastic forces and inertia
    noise : rounding [J] of the function: strains are small differences from F = I
    """

    def __init__(
        self,
        motion: ReducedMotion,
        base: np.ndarray,
        rate: np.ndarray,
        reach: float,
        pull: np.ndarray,
        push: np.ndarray,
    ):
        masses = motion.body.masses
        inertia, drag, lag = masses / reach**2, motion._alpha * masses / reach, motion._beta / reach
        self._cells, self._share, self._curvature = motion.body.cells, 1.0 + lag, inertia + drag
        # inertia and drag together pull towards one point
        self._centre = base + inertia * reach * rate / self._curvature
        self._force = push + lag * pull
        self.at_rest = self._curvature + self._share
        parts = (push, pull, inertia * reach * rate)
        self.scale = sum(float(np.linalg.norm(part)) for part in parts) + LEAST_SCALE * motion.flattening
        self.noise = STRAIN_ROUNDING * motion.flattening * self.scale

    def evaluate(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the function to minimise [J] at ``q`` (r,) and its gradient (r,)."""
        energy, gradient = self._cells.evaluate(q)
        away = q - self._centre
        pull = self._curvature * away
        total = 0.5 * float(pull @ away) + self._share * energy - float(self._force @ q)
        return total, pull + self._share * gradient - self._force
