"""Move a body in few modes: the elements' own implicit midpoint rule, in the coordinates of a reduced body."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy.interpolate import interp1d

from palpate.benchmark.richardson import RATIO_DOUBT
from palpate.effects.elements import OnePass
from palpate.effects.push import disc, factor
from palpate.effects.rayleigh import stage_factors
from palpate.effects.settings import Gravity, Load, Loads, Push, Rayleigh
from palpate.errors import NotConverged
from palpate.linalg.minimiser import Product
from palpate.models.contact_modes.snapshots import directions
from palpate.models.reduced import cholesky
from palpate.models.reduced.cubature import energy_for_motions, points_and_means
from palpate.models.reduced.cubature_points import clamped_tangent, elastic, least_det, scratch_of
from palpate.models.reduced.energy import ReducedEnergy
from palpate.models.reduced_body import BodyAtRest, ReducedBody, limit_modes
from palpate.solvers.quadratic_motion import Midpoint, Reached

TOLERANCE = 1e-3
"""Relative residual of a step."""
BALANCE = 0.05
"""Largest imbalance of energy, over the work that loads have done or taken back."""
SAMPLES, MISSED_RESIDUAL = 8, 0.03
"""Instants at which residuals of the elements are answered, and the relative residual of these answers."""
LEAST_DET = 0.3
"""Smallest det F of a cubature point that is believed: below, elements around it may be flat or inverted."""


class CubatureEnergy(OnePass):
    """The elastic energy of a reduced ``model`` at coordinates (r, 1), as an effect; its forces are in √J."""

    def __init__(self, model: ReducedEnergy):
        super().__init__()
        self._model, self._scratch = model, scratch_of(model.body)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        energy, pull = elastic(x[:, 0], self._model.body, self._scratch)
        force[:, 0] -= pull
        return energy

    def clamped(self, x: np.ndarray) -> np.ndarray:
        """Return the Hessian (r, r), that of each cubature point clamped to be positive."""
        return self._model.rest + clamped_tangent(x[:, 0], *self._model.points, *self._model.law)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F of all cubature points."""
        return float(least_det(x[:, 0], self._model.body[0][0], len(self._model.points.volumes)))


class ReducedMotion(Midpoint):
    """A reduced ``body`` under weight and pushes; loads and rayleigh are as ``QuadraticMotion`` has them.

    Trap: a push at a place that the body has no modes for is answered by the others; ``misses`` shows it.
    """

    def __init__(self, body: ReducedBody, loads: Loads, rayleigh: Rayleigh):
        self.body, self.elastic_energy, r = body, CubatureEnergy(body.model), len(body.modes.masses)
        self.rest, self.held, self.masses = np.zeros((r, 1)), np.zeros(r, dtype=bool), np.diag(body.modes.masses)
        self._alpha, self._beta = rayleigh.mass_1_s, rayleigh.stiffness_s
        self.rayleigh, self.nodal = rayleigh, _nodal(body.at_rest, loads)
        self._shares = [(body.project(force), push) for force, push in self.nodal]
        self.extra: Callable[[float], np.ndarray] | None = None
        self.scale_n = sum(float(np.linalg.norm(force)) for force, _ in self._shares)

    def load_at(self, t: float) -> np.ndarray:
        return _sum(self._shares, t) + (0.0 if self.extra is None else self.extra(t))

    def energy(self, x: np.ndarray) -> float:
        return self.elastic_energy.energy(x) - float(np.vdot(self.load, x))

    def force(self, x: np.ndarray) -> np.ndarray:
        return self.elastic_energy.force(x) + self.load

    def damping(self, x: np.ndarray) -> Product:
        self._clamped, self._factor = self.elastic_energy.clamped(x), None
        matrix = self._alpha * self.masses + self._beta * self._clamped
        return lambda v: matrix @ v

    def _preconditioner(self, h: float, x: np.ndarray) -> Product:
        """Return the inverse of the Hessian of a step of ``h`` [s], factored at its first use."""
        of_mass, of_stiffness = stage_factors(self._alpha, self._beta, 0.5 * h)
        mass = of_mass * self.masses

        def solve(force: np.ndarray) -> np.ndarray:
            if self._factor is None:
                hessian = mass + of_stiffness * self._clamped
                if not cholesky.factor(hessian):
                    raise NotConverged("the reduced body has lost its stiffness; take tighter cells", [])
                self._factor = hessian
            solution = force.copy()
            cholesky.solve(self._factor, solution[:, 0])
            return solution

        return solve


@dataclass(frozen=True, eq=False)
class MotionInModes:
    """Displacements ``moved`` (f, n_surface, 3) [m] at the ends of frames, of steps of ``step_s`` that are ``reached``.

    seconds : (steps,) [s] of each; balance : what of the loads' work is neither kept nor damped, over that work
    """

    moved: np.ndarray
    step_s: float
    reached: list[Reached]
    seconds: np.ndarray
    balance: float


def move(motion: ReducedMotion, duration_s: float, frames: int, steps: int) -> MotionInModes:
    """Move from rest for ``duration_s`` [s], in ``steps`` equal steps, a multiple of ``frames``.

    NotConverged for a step that is not found, where the body loses its stiffness, where a cubature point keeps less
    than LEAST_DET of its volume, and where the energy does not balance.
    """
    h, reached, seconds = duration_s / steps, [], []
    started = perf_counter()
    for each in motion.steps(h, steps, TOLERANCE):
        if not (least := motion.elastic_energy.least_det(each.x)) >= LEAST_DET:
            raise NotConverged(
                f"a cell of the reduced body keeps {least:.2g} of its volume, and modes are not to be believed below "
                f"{LEAST_DET:g}; lower the load",
                [least],
            )
        reached.append(each)
        seconds.append(perf_counter() - started)
        started = perf_counter()
    work, damped = (sum(getattr(each, name) for each in reached) for name in ("work_j", "lost_j"))
    total = sum(abs(each.work_j) for each in reached)
    balance = abs(motion.total_energy(reached[-1].x, reached[-1].v) + damped - work) / max(total, np.finfo(float).tiny)
    if not balance <= BALANCE:
        raise NotConverged(
            f"{balance:.1%} of the work of the loads is neither kept nor damped; take shorter steps", [balance]
        )
    body = motion.body
    ends = [each.x for each in reached[steps // frames - 1 :: steps // frames]]
    return MotionInModes(body.on_surface(body.modes.limit, ends), h, reached, np.array(seconds), balance)


def misses(motion: ReducedMotion, simulated: MotionInModes) -> float:
    """Estimate the error [m] of a motion in modes, RMS over the surface, from its modes, cubature points and levels.

    At SAMPLES instants the residual of the elements that were reduced, moved alike, is answered by a static response.
    The part of it within the modes acts as a load, under which the motion is computed again, as errors build up in time
    in a body that swings or is about to buckle; the part outside of the modes counts as it is. The error of the levels
    is how much displacements would change if their ratio were lower by RATIO_DOUBT.
    """
    body, h, elements = motion.body, simulated.step_s, motion.body.at_rest.motion
    count, modes = len(simulated.reached), body.modes
    numbers = np.unique(np.linspace(0, count - 1, SAMPLES + 1).round().astype(int)[1:])
    # residuals of the elements at some instants, within the modes and outside
    shares, outside = [np.zeros_like(motion.rest)], 0.0
    for number in numbers:  # the steps at whose middles elements are asked
        v_begin = simulated.reached[number - 1].v if number else np.zeros_like(motion.rest)
        v_end, q = simulated.reached[number].v, simulated.reached[number].middle
        x, v, a = (modes.own @ each[:, 0] for each in (q, (v_begin + v_end) / 2.0, (v_end - v_begin) / h))
        load = _sum(motion.nodal, (number + 0.5) * h)
        lacking = elements.unbalanced_response(x, v, a, load, motion.rayleigh, MISSED_RESIDUAL)
        stiff = body.at_rest.elements.multiply(np.ascontiguousarray(lacking[:, :, None]))[:, :, 0]
        inside = np.tensordot(modes.own, stiff, ((0, 1), (0, 1)))[:, None]
        shares.append(motion.elastic_energy.clamped(q) @ inside)
        outside += float(np.sum((body.at_rest.surface @ (lacking - modes.own @ inside[:, 0])) ** 2))
    outside /= len(numbers) * len(body.at_rest.body.fine.surface)
    # how the motion changes with the residuals within the modes as loads
    times = np.append(0.0, (numbers + 0.5) * h)
    motion.extra = interp1d(times, np.array(shares), axis=0, bounds_error=False, fill_value="extrapolate")
    try:
        states = [each.x for each in motion.steps(h, count, TOLERANCE)]
    finally:
        motion.extra = None
    per_frame = count // len(simulated.moved)
    built_up = body.on_surface(modes.limit, states[per_frame - 1 :: per_frame]) - simulated.moved
    ends = [each.x for each in simulated.reached[per_frame - 1 :: per_frame]]
    of_levels = RATIO_DOUBT * body.at_rest.gain * body.on_surface(modes.limit - modes.own, ends)
    mean_squares = [float(np.mean(np.sum(each**2, axis=2))) for each in (built_up, of_levels)]
    return float(np.sqrt(outside + sum(mean_squares)))


def _nodal(rest: BodyAtRest, loads: Loads) -> list[tuple[np.ndarray, Load | None]]:
    """Return the forces (n, 3) [N] of weight and of each push at full strength on the elements, each with its push."""
    pulls = [np.array(loads.acceleration_m_s2, dtype=float)] if loads.gravity else []
    pushed = [(rest.spread(disc(push)) @ np.array(push.force_n, dtype=float), push) for push in loads.pushes]
    return [*((rest.weigh() @ pull, None) for pull in pulls), *pushed]


def _sum(loads: Sequence[tuple[np.ndarray, Load | None]], t: float) -> np.ndarray:
    return np.sum([force if push is None else factor(push, t) * force for force, push in loads], axis=0)


STEPS_OF_PERIOD, FITTED = 24, (0, 1, 3, 5, 6, 8)
"""Steps of a motion that cubature points are fitted to, and in which of nine directions; in the others they are held
out."""


def prepare(rest: BodyAtRest, loads: Loads, rayleigh: Rayleigh, bent: int, tolerance: float) -> ReducedBody:
    """Reduce a body for pushes at the places of ``loads``, and for forces as large in other directions and courses.

    bent, tolerance : as in ``limit_modes`` and ``energy_for_motions``; NotConverged as the latter
    Cubature points are fitted to motions of a model of means of eight elements each. Its loads are tilted by up to 45°
    in nine directions, and their course follows the body's slowest vibration.
    """
    started = perf_counter()
    discs = [rest.spread(disc(push)) for push in loads.pushes]
    weight_loads = [rest.weigh()] if loads.gravity else []
    modes, elements = limit_modes(rest, [*discs, *weight_loads], bent), rest.elements
    pressed = np.any([np.zeros_like(rest.weigh()), *discs], axis=(0, 2, 3))
    means = points_and_means(elements, modes.slopes, np.zeros(len(elements.couples), dtype=bool), 8)
    no_loads = np.zeros((len(modes.masses), 1))
    trial = ReducedBody(rest, modes, ReducedEnergy(means, no_loads, elements.law), 0.0, 0.0)
    shown: dict[bool, list[np.ndarray]] = {True: [], False: []}
    for number in range(len(directions(np.ones(3)))):
        motion = ReducedMotion(trial, _elsewhere(loads, rest.period_s, number), rayleigh)
        steps = motion.steps(rest.period_s / STEPS_OF_PERIOD, STEPS_OF_PERIOD, TOLERANCE)
        shown[number in FITTED] += [each.middle[:, 0] for each in steps][1::2]
    energy, near = CubatureEnergy(trial.model), pressed[elements.couples].any(axis=1)
    states, reduction = (np.array(shown[True]), np.array(shown[False])), (elements, modes.slopes, modes.masses, near)
    model, missed = energy_for_motions(*reduction, lambda q: energy.clamped(q[:, None]), *states, tolerance)
    return ReducedBody(rest, modes, model, missed, perf_counter() - started)


def _elsewhere(loads: Loads, period_s: float, number: int) -> Loads:
    """Return ``loads`` turned into the direction ``number`` of nine; pushes rise, hold and fall within one period."""
    gravity = push = None
    if loads.gravity:
        pull = np.array(loads.acceleration_m_s2, dtype=float)
        size = max(float(np.linalg.norm(pull)), np.finfo(float).tiny)
        gravity = Gravity(acceleration_m_s2=(size * directions(-pull / size)[number]).tolist())
    course = {"start_s": 0.0, "press_s": 0.3 * period_s, "hold_s": 0.3 * period_s, "release_s": 0.15 * period_s}
    turned = [np.linalg.norm(p.force_n) * directions(np.array(p.normal))[number] for p in loads.pushes]
    if loads.push:
        pushes = [p.but(**course, force_n=force.tolist()) for p, force in zip(loads.pushes, turned, strict=True)]
        push = Push(loads=pushes)
    return Loads(gravity=gravity, push=push)
