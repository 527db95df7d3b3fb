"""Spring parameters by descent: the adjoint's gradient of the fitness, and quasi-Newton steps in log E."""

from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from palpate.models.springs.calibration import spring_motion
from palpate.models.springs.calibration.adjoint import Gradient, pull_back
from palpate.models.springs.calibration.fitness import ALPHA_S, Fit, Fitness, Range

MEMORY = 30
"""Pairs of steps and gradients from which L-BFGS estimates the curvature."""
LEAST_GAIN = 1e-7
"""Relative gain of a step at which L-BFGS stops."""
LEAST_VOLUME = 1e-6
"""Least stiffness of a fitted volume force, relative to the largest; at 0 it would have no derivative."""


def value_and_gradient(fitness: Fitness, young: np.ndarray, volume_n_m: float) -> tuple[float, Gradient]:
    """Compute the fitness [m] of moduli ``young`` (n,) [Pa] (paper 2, eq. 9) and its derivatives.

    volume_n_m : stiffness κ of the volume force [N/m], 0 for none
    Raises NotConverged if the motion diverges. Trap: a norm has no derivative where the difference is zero, as at the
    start; there it is taken to be zero.
    """
    model, press, settings = fitness.model, fitness.press, replace(fitness.settings, volume_n_m=volume_n_m)
    motion = spring_motion.trajectory(model, young, press, settings)
    value, by_motion = 0.0, []
    for kept, wanted, weight in zip(motion, (fitness.positions, fitness.velocities), (1.0, ALPHA_S), strict=True):
        residual = settings.compared(kept) - wanted
        norms = np.linalg.norm(residual, axis=2, keepdims=True)
        value -= weight * float(norms.sum())
        by_motion.append(-weight * np.divide(residual, norms, out=np.zeros_like(residual), where=norms > 0.0))
    return value, pull_back(model, young, press, settings, motion, tuple(by_motion))


def descend(presses: list[Fitness], start_pa: np.ndarray, limits: Range, evaluations: int) -> Fit:
    """Find the best moduli by L-BFGS from ``start_pa`` (n,) [Pa], with ``evaluations`` motions and adjoints.

    presses : fitnesses of the same springs, whose sum is maximised
    One row of history per evaluation of all of them. Raises NotConverged if a motion diverges on the way.
    """
    return _search(presses, start_pa, limits, evaluations, None)[0]


def descend_with_volume(
    presses: list[Fitness], start_pa: np.ndarray, limits: Range, evaluations: int, most_n_m: float
) -> tuple[Fit, float]:
    """Run ``descend`` for the moduli and the volume force's stiffness [N/m], at most ``most_n_m``."""
    return _search(presses, start_pa, limits, evaluations, most_n_m)


def _search(
    presses: list[Fitness], start_pa: np.ndarray, limits: Range, evaluations: int, most_n_m: float | None
) -> tuple[Fit, float]:
    """Minimise over log E of each node and, with ``most_n_m``, the volume force's stiffness relative to it."""
    n, begin, given = len(start_pa), perf_counter(), presses[0].settings.volume_n_m
    history: list[list[float]] = []
    best = (-np.inf, start_pa, given)

    def cost(unknowns):
        nonlocal best
        young = np.exp(unknowns[:n])
        volume = given if most_n_m is None else float(unknowns[n]) * most_n_m
        found = [value_and_gradient(press, young, volume) for press in presses]
        value = sum(value for value, _ in found)
        if value > best[0]:
            best = (value, young, volume)
        history.append([len(history) + 1, perf_counter() - begin, best[0]])
        by_unknowns = sum(gradient.young for _, gradient in found) * young
        if most_n_m is not None:
            by_unknowns = np.append(by_unknowns, most_n_m * sum(gradient.volume for _, gradient in found))
        return -value, -by_unknowns

    start = np.log(np.clip(start_pa, limits.low_pa, limits.high_pa))
    bounds = [(np.log(limits.low_pa), np.log(limits.high_pa))] * n
    if most_n_m is not None:
        start = np.append(start, np.clip(given / most_n_m, LEAST_VOLUME, 1.0))
        bounds.append((LEAST_VOLUME, 1.0))
    options = {"maxcor": MEMORY, "maxfun": evaluations, "maxiter": evaluations, "ftol": LEAST_GAIN, "gtol": 0.0}
    minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    value, young, volume = best
    return Fit(young, value, np.array(history)), volume
