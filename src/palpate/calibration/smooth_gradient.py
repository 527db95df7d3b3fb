"""A fit to one press that stays near one modulus: what that press does not tell is not made up."""

from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from palpate.calibration import spring_motion
from palpate.calibration.adjoint import pull_back
from palpate.calibration.fitness import Fit, Fitness, Range
from palpate.calibration.gradient_descent import MEMORY

ENOUGH = 0.05
"""The error of the fitted press, RMSE of the peak, at which the penalty is weak enough (the discrepancy principle).

Fitted to all presses at once, the springs are about as wrong as this: to fit one of them better is to fit what springs
cannot do.
"""
STRONGEST, A_DECADE, WEAKEST = 1e-2, 4, 1e-6
"""The strengths of the penalty that are tried, downwards, and how many in a factor of ten."""


def descend_smoothly(fitness: Fitness, start_pa: np.ndarray, limits: Range, evaluations: int) -> Fit:
    """Moduli (n,) [Pa] with the least Σ (log E − mean log E)² that follow the fitness's press to ``ENOUGH``.

    By L-BFGS on RMSE²/peak² of the positions plus a strength times that sum; the strongest that is enough is taken, or
    the last where ``evaluations`` of motion and adjoint run out. Tikhonov's regularisation, its strength by Morozov's
    discrepancy principle. One line of history an evaluation, with the fitness of eq. 9, which is not what is sought.
    Trap: with the norms of eq. 9 in place of squares, moduli must differ more until the press is within 5 %, and the
    other presses of paper 2's cube come out at 17 and not at 14 % of the peak.
    """
    begin, history, logs = perf_counter(), [], np.log(np.clip(start_pa, limits.low_pa, limits.high_pa))

    def cost(logs, strength):
        young = np.exp(logs)
        square, slopes = square_and_slopes(fitness, young)
        best = max(history[-1][2] if history else -np.inf, float(fitness(young[None])[0]))
        history.append([len(history) + 1, perf_counter() - begin, best])
        off = logs - logs.mean()
        return square + strength * off @ off, slopes * young + 2.0 * strength * off

    bounds = [(np.log(limits.low_pa), np.log(limits.high_pa))] * len(logs)
    count = round(A_DECADE * np.log10(STRONGEST / WEAKEST))
    for strength in np.geomspace(STRONGEST, WEAKEST, count + 1):
        left = evaluations - len(history)
        options = {"maxcor": MEMORY, "maxfun": left, "maxiter": left, "ftol": 1e-9, "gtol": 0.0}
        found = minimize(cost, logs, strength, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        logs = found.x
        square = found.fun - strength * ((logs - logs.mean()) ** 2).sum()
        if square <= ENOUGH**2 or len(history) >= evaluations:
            break
    young = np.exp(logs)
    return Fit(young, float(fitness(young[None])[0]), np.array(history))


def square_and_slopes(fitness: Fitness, young: np.ndarray) -> tuple[float, np.ndarray]:
    """RMSE² of the key points' positions over steps, as a share of the farthest that one goes², and slopes (n,) [1/Pa].

    Raises NotConverged if springs blow up.
    """
    model, press, settings = fitness.model, fitness.press, fitness.settings
    motion = spring_motion.trajectory(model, young, press, settings)
    off = settings.keys.of(motion[0][1:]) - fitness.positions
    peak = np.linalg.norm(fitness.positions - settings.keys.of(model.nodes), axis=2).max()
    scale = off[..., 0].size * peak**2
    slopes = pull_back(model, young, press, settings, motion, (2.0 * off / scale, np.zeros_like(off)))
    return float((off**2).sum() / scale), slopes.young
