"""Fit spring moduli by descent: quasi-Newton steps in log E with the gradient of the motion's adjoint.

The adjoint gives derivatives by all moduli at the cost of about two motions. Backwards through the steps of
spring_motion.py, with a = ∂L/∂x and b = ∂L/∂v of all that comes later:

    b += h a;  w = h b/m, 0 on held nodes;  a += (∂f/∂x)ᵀ w;  b += (∂f/∂v)ᵀ w;  ∂L/∂k += w·∂f/∂k, μ and κ alike

Trap: the whole motion must be stored, 48 bytes per node and step; the cube's 120 nodes need 6 kB per step.
"""

from dataclasses import replace
from time import perf_counter

import numba
import numpy as np
from scipy.optimize import minimize

from palpate.effects.volume_preservation import distance_sum
from palpate.models.springs import spring_motion
from palpate.models.springs.fitness import ALPHA_S, Fit, Fitness, Range, Track
from palpate.models.springs.spring_motion import Press, Settings, SpringModel


def pull_back(
    model: SpringModel,
    young: np.ndarray,
    press: Press,
    settings: Settings,
    motion: tuple[np.ndarray, np.ndarray],
    by_motion: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, float]:
    """Return the derivatives of a number by the moduli, from its derivatives by the key points' motion: the adjoint.

    Those are (n,) [1/Pa], by the modulus of each node, and by the stiffness of the volume force [m/N].
    motion : of ``spring_motion.trajectory``
    by_motion : by positions and velocities, both (steps/every, p, 3), as ``spring_motion.simulate`` returns these
    """
    (x, v), (by_x, by_v) = motion, by_motion
    stiffness = spring_motion.stiffnesses(model, young)
    damping = spring_motion.dampings(model, stiffness, settings.damping_ratio)
    by_stiffness, by_damping, by_volume = np.zeros_like(stiffness), np.zeros_like(stiffness), np.zeros(1)
    _, pairs, rest, tetrahedra, volume_rest, volume, mobility, _, _, h = spring_motion.constants(model, press, settings)
    _backwards(
        x, v, by_x, by_v, settings.every, settings.keys.corners, settings.keys.shares, stiffness, damping, pairs, rest,
        tetrahedra, volume_rest, volume, mobility, h, by_stiffness, by_damping, by_volume,
    )  # fmt: skip
    by_stiffness += by_damping * damping / (2.0 * stiffness)  # damping goes as its root
    halves = np.repeat(0.5 * by_stiffness * model.weights, 2)  # to each end's modulus
    return np.bincount(pairs.ravel(), halves, minlength=len(young)), float(by_volume[0])


@numba.njit(cache=True, error_model="numpy")
def _backwards(
    x, v, by_x, by_v, every, corners, shares, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume,
    mobility, h, by_stiffness, by_damping, by_volume,
):  # fmt: skip
    """Step a = ∂L/∂x, b = ∂L/∂v backwards through a motion; add ∂L by stiffness, damping and κ to the last arrays."""
    a, b, w = np.zeros_like(x[0]), np.zeros_like(x[0]), np.empty_like(x[0])
    for s in range(len(x) - 2, -1, -1):  # from the last step to the first
        frame = s // every
        for p in range(len(corners) if (s + 1) % every == 0 else 0):  # key points
            for c in range(4):
                for i in range(3):
                    a[corners[p, c], i] += shares[p, c] * by_x[frame, p, i]
                    b[corners[p, c], i] += shares[p, c] * by_v[frame, p, i]
        for node in range(len(w)):
            for i in range(3):
                b[node, i] += h * a[node, i]
                w[node, i] = h * mobility[node] * b[node, i]
        _through_springs(x[s], v[s], w, stiffness, damping, pairs, rest, a, b, by_stiffness, by_damping)
        if volume > 0.0:
            _through_volume(x[s], w, tetrahedra, volume_rest, volume, a, by_volume)


@numba.njit(cache=True, error_model="numpy")
def _through_springs(x, v, w, stiffness, damping, pairs, rest, a, b, by_stiffness, by_damping):
    """Add the derivatives of w·f by positions to ``a``, velocities to ``b``, stiffness and damping, f of all springs.

    w·f of one is T n·d with unit vector n, tension T and d = w₁ − w₂; those by its first end are minus the second's.
    """
    n, d, relative_v = np.empty(3), np.empty(3), np.empty(3)
    for e in range(len(pairs)):
        node_1, node_2 = pairs[e, 0], pairs[e, 1]
        length = 0.0
        for i in range(3):
            n[i] = x[node_2, i] - x[node_1, i]
            length += n[i] * n[i]
        length = np.sqrt(length)
        rate = d_along = 0.0
        for i in range(3):
            n[i] /= length
            relative_v[i] = v[node_2, i] - v[node_1, i]
            d[i] = w[node_1, i] - w[node_2, i]
            rate += n[i] * relative_v[i]
            d_along += n[i] * d[i]
        stretch = length - rest[e]
        tension = stiffness[e] * stretch + damping[e] * rate
        by_stiffness[e] += stretch * d_along
        by_damping[e] += rate * d_along
        for i in range(3):
            rotation = damping[e] * d_along * (relative_v[i] - rate * n[i]) + tension * (d[i] - d_along * n[i])
            by_end = stiffness[e] * d_along * n[i] + rotation / length
            a[node_2, i] += by_end
            a[node_1, i] -= by_end
            b[node_2, i] += damping[e] * d_along * n[i]
            b[node_1, i] -= damping[e] * d_along * n[i]


@numba.njit(cache=True, error_model="numpy")
def _through_volume(x, w, tetrahedra, volume_rest, volume, a, by_volume):
    """Add the derivatives of w·f by positions to ``a`` and by κ = ``volume`` to ``by_volume``, f the volume force.

    w·f of a tetrahedron is −κ (S − S₀) g·w, S its sum of distances to the middle, g = ∂S/∂x; ∂²S/∂x² is symmetric.
    """
    lengths, u, projected = np.empty(4), np.empty((8, 3)), np.empty((4, 3))
    for e in range(len(tetrahedra)):
        stretch = distance_sum(x, tetrahedra[e], lengths, u) - volume_rest[e]
        g_dot_w = 0.0
        for c in range(4):
            for i in range(3):
                g_dot_w += u[4 + c, i] * w[tetrahedra[e, c], i]
        by_volume[0] -= stretch * g_dot_w
        for i in range(3):
            mean = 0.0
            for c in range(4):
                mean += 0.25 * w[tetrahedra[e, c], i]
            for c in range(4):
                projected[c, i] = w[tetrahedra[e, c], i] - mean
        for c in range(4):
            radial = 0.0
            for i in range(3):
                radial += u[c, i] * projected[c, i]
            for i in range(3):
                projected[c, i] = (projected[c, i] - radial * u[c, i]) / lengths[c] if lengths[c] > 0.0 else 0.0
        for i in range(3):
            mean = 0.25 * (projected[0, i] + projected[1, i] + projected[2, i] + projected[3, i])
            for c in range(4):
                change = g_dot_w * u[4 + c, i] + stretch * (projected[c, i] - mean)
                a[tetrahedra[e, c], i] -= volume * change


MEMORY = 30
"""Pairs of steps and gradients from which L-BFGS estimates the curvature."""
LEAST_VOLUME = 1e-6
"""Least stiffness of a fitted volume force, relative to the largest; at 0 it would have no derivative."""


def value_and_gradient(fitness: Fitness, young: np.ndarray, volume_n_m: float) -> tuple[float, np.ndarray, float]:
    """Compute the fitness [m] of moduli ``young`` (n,) [Pa] (paper 2, eq. 9) and its derivatives of ``pull_back``.

    volume_n_m : stiffness κ of the volume force [N/m], 0 for none
    Raises NotConverged if the motion diverges. Trap: a norm has no derivative where the difference is zero, as at the
    start; there it is taken to be zero.
    """
    model, press, settings = fitness.model, fitness.press, replace(fitness.settings, volume_n_m=volume_n_m)
    motion = spring_motion.trajectory(model, young, press, settings)
    value, by_motion = 0.0, []
    for simulated, wanted, weight in zip(motion, (fitness.positions, fitness.velocities), (1.0, ALPHA_S), strict=True):
        residual = settings.compared(simulated) - wanted
        norms = np.linalg.norm(residual, axis=2, keepdims=True)
        value -= weight * float(norms.sum())
        by_motion.append(-weight * np.divide(residual, norms, out=np.zeros_like(residual), where=norms > 0.0))
    return value, *pull_back(model, young, press, settings, motion, tuple(by_motion))


def descend(
    presses: list[Fitness], start_pa: np.ndarray, limits: Range, evaluations: int, most_n_m: float | None = None
) -> tuple[Fit, float]:
    """Return the best moduli by L-BFGS from ``start_pa`` (n,) [Pa], and the stiffness [N/m] of the volume force.

    presses : fitnesses of the same springs, whose sum is maximised by ``evaluations`` motions and adjoints of each
    most_n_m : the largest stiffness of the volume force, if that is searched for too; None leaves it as it is
    The history has a row per evaluation of all presses. NotConverged if a motion diverges.
    """
    n, started, initial_n_m = len(start_pa), perf_counter(), presses[0].settings.volume_n_m
    history: list[list[float]] = []
    best = (-np.inf, start_pa, initial_n_m)

    def cost(unknowns):
        nonlocal best
        young = np.exp(unknowns[:n])
        volume = initial_n_m if most_n_m is None else float(unknowns[n]) * most_n_m
        of_presses = [value_and_gradient(press, young, volume) for press in presses]
        value, by_young, by_volume = map(sum, zip(*of_presses, strict=True))
        if value > best[0]:
            best = (value, young, volume)
        history.append([len(history) + 1, perf_counter() - started, best[0]])
        return -value, -np.append(by_young * young, [] if most_n_m is None else most_n_m * by_volume)

    start, bounds = np.log(np.clip(start_pa, *limits)), [tuple(np.log(limits))] * n
    if most_n_m is not None:
        start = np.append(start, np.clip(initial_n_m / most_n_m, LEAST_VOLUME, 1.0))
        bounds.append((LEAST_VOLUME, 1.0))
    options = {"maxcor": MEMORY, "maxfun": evaluations, "maxiter": evaluations, "ftol": 1e-7, "gtol": 0.0}
    minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    value, young, volume = best
    return Fit(young, value, np.array(history)), volume


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
    track, logs, bounds = Track(fitness), np.log(np.clip(start_pa, *limits)), [tuple(np.log(limits))] * len(start_pa)

    def cost(logs, strength):
        young = np.exp(logs)
        square, gradient = square_and_gradient(fitness, young)
        track(young[None])
        deviation = logs - logs.mean()
        return square + strength * deviation @ deviation, gradient * young + 2.0 * strength * deviation

    count = round(PER_DECADE * np.log10(LARGEST / SMALLEST))
    for strength in np.geomspace(LARGEST, SMALLEST, count + 1):
        remaining = evaluations - len(track.history)
        options = {"maxcor": MEMORY, "maxfun": remaining, "maxiter": remaining, "ftol": 1e-9, "gtol": 0.0}
        result = minimize(cost, logs, strength, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        logs = result.x
        square = result.fun - strength * ((logs - logs.mean()) ** 2).sum()
        if square <= TARGET_ERROR**2 or len(track.history) >= evaluations:
            break
    young = np.exp(logs)
    return Fit(young, float(fitness(young[None])[0]), np.array(track.history))


def square_and_gradient(fitness: Fitness, young: np.ndarray) -> tuple[float, np.ndarray]:
    """Compute RMSE² of the key points' positions over steps, relative to the largest displacement², and derivatives.

    The derivatives are (n,) [1/Pa]. Raises NotConverged if the motion diverges.
    """
    model, press, settings = fitness.model, fitness.press, fitness.settings
    motion = spring_motion.trajectory(model, young, press, settings)
    residual = settings.compared(motion[0]) - fitness.positions
    peak = np.linalg.norm(fitness.positions - settings.keys.of(model.nodes), axis=2).max()
    scale = residual[..., 0].size * peak**2
    by_motion = 2.0 * residual / scale, np.zeros_like(residual)
    return float((residual**2).sum() / scale), pull_back(model, young, press, settings, motion, by_motion)[0]
