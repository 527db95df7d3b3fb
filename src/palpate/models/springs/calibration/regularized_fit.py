"""Fit to one press with moduli that vary as little as possible, as one press does not determine them all."""

from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from palpate.models.springs.calibration import spring_motion
from palpate.models.springs.calibration.adjoint import pull_back
from palpate.models.springs.calibration.fitness import Fit, Fitness, Range
from palpate.models.springs.calibration.gradient_descent import MEMORY

TARGET_ERROR = 0.05
"""Error of the fitted press, RMSE / peak, at which the penalty is weak enough (the discrepancy principle).

Fitted to all presses at once, the springs have about this error: to fit one press better is to fit what springs
cannot represent.
"""
LARGEST, PER_DECADE, SMALLEST = 1e-2, 4, 1e-6
"""Strengths of the penalty that are tried, in decreasing order, and their number per decade."""


def descend_smoothly(fitness: Fitness, start_pa: np.ndarray, limits: Range, evaluations: int) -> Fit:
    """Find moduli (n,) [Pa] with the least Σ (log E − mean log E)² that fit the press to ``TARGET_ERROR``.

    By L-BFGS on RMSE²/peak² of the positions plus a strength times that sum; the largest sufficient strength is taken,
    or the last when ``evaluations`` of motion and adjoint run out. Tikhonov regularisation, with its strength by
    Morozov's discrepancy principle. One row of history per evaluation, with the fitness of eq. 9, which is not the
    objective here.
    Trap: with the norms of eq. 9 in place of squares, moduli must differ more until the press is within 5 %, and the
    other presses of paper 2's cube have errors of 17 and not 14 % of the peak.
    """
    begin, logs = perf_counter(), np.log(np.clip(start_pa, limits.low_pa, limits.high_pa))
    history: list[list[float]] = []

    def cost(logs, strength):
        young = np.exp(logs)
        square, gradient = square_and_gradient(fitness, young)
        best = max(history[-1][2] if history else -np.inf, float(fitness(young[None])[0]))
        history.append([len(history) + 1, perf_counter() - begin, best])
        deviation = logs - logs.mean()
        return square + strength * deviation @ deviation, gradient * young + 2.0 * strength * deviation

    bounds = [(np.log(limits.low_pa), np.log(limits.high_pa))] * len(logs)
    count = round(PER_DECADE * np.log10(LARGEST / SMALLEST))
    for strength in np.geomspace(LARGEST, SMALLEST, count + 1):
        left = evaluations - len(history)
        options = {"maxcor": MEMORY, "maxfun": left, "maxiter": left, "ftol": 1e-9, "gtol": 0.0}
        found = minimize(cost, logs, strength, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        logs = found.x
        square = found.fun - strength * ((logs - logs.mean()) ** 2).sum()
        if square <= TARGET_ERROR**2 or len(history) >= evaluations:
            break
    young = np.exp(logs)
    return Fit(young, float(fitness(young[None])[0]), np.array(history))


def square_and_gradient(fitness: Fitness, young: np.ndarray) -> tuple[float, np.ndarray]:
    """Compute RMSE² of the key points' positions over steps, relative to the largest displacement², and derivatives.

    The derivatives are (n,) [1/Pa]. Raises NotConverged if the motion diverges.
    """
    model, press, settings = fitness.model, fitness.press, fitness.settings
    motion = spring_motion.trajectory(model, young, press, settings)
    residual = settings.compared(motion[0]) - fitness.positions
    peak = np.linalg.norm(fitness.positions - settings.keys.of(model.nodes), axis=2).max()
    scale = residual[..., 0].size * peak**2
    gradient = pull_back(model, young, press, settings, motion, (2.0 * residual / scale, np.zeros_like(residual)))
    return float((residual**2).sum() / scale), gradient.young
