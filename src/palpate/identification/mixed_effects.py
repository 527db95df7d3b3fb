"""Likelihood of presses whose places differ: a mixed-effects model with conditional modes and Laplace's approximation.

The force F of a press at depth d is  asinh(F/c) = asinh(m/c) + σ ε,  log m = log E + log f(d − o) + a + r + b l + e l,
l = log(d/d₀), with ε standard normal: the noise is σ F at large forces, and σ c at small ones. The offset o of first
touch and the level r are normal over presses; the level a and the exponent b are normal over places; e is common to
all. The modes of the effects given the forces are found by the Gauss-Newton method, and the integral over the effects
is Laplace's (Lindstrom and Bates, Biometrics 46, 1990; Pinheiro and Bates, J. Comput. Graph. Stat. 4, 1995).
"""

from typing import NamedTuple

import numba
import numpy as np

GAUSS_NEWTON_STEPS, STEP_TOLERANCE = 40, 1e-9
"""Most steps to the modes of a place's effects, and the step in their deviations that ends them. Trap: the determinant
changes in proportion to what is left, and derivatives are taken by differences."""
LARGEST_STEP = 2.0
"""Largest step of an effect, in its standard deviations."""


class Layout(NamedTuple):
    """Points of presses, and which of them belong to which press and place.

    depth_m, force_n, level : (n,) points, press after press, place after place; level is log(d/d₀)
    weight : (n,) 1 where a force is fitted, 0 where it is predicted
    press_start : (presses + 1,) first point of each press; place_start : (places + 1,) first press of each place
    table : (presses,) number of each press's table of forces
    """

    depth_m: np.ndarray
    force_n: np.ndarray
    level: np.ndarray
    weight: np.ndarray
    press_start: np.ndarray
    place_start: np.ndarray
    table: np.ndarray

    def points(self, press: int) -> slice:
        """Return which points are of press number ``press``."""
        return slice(self.press_start[press], self.press_start[press + 1])


class Spread(NamedTuple):
    """Noise, and standard deviations of the effects.

    noise : σ; floor_n : c [N]; place, shape : of a and b over places; repeat : of r over presses of a place
    offset_m, offset_scatter_m : mean and standard deviation of o over presses [m]; excess : e
    """

    noise: float
    floor_n: float
    place: float
    shape: float
    repeat: float
    offset_m: float
    offset_scatter_m: float
    excess: float


class Modes(NamedTuple):
    """Likelihood, minus2 (places,) of −2 log, and predictions with the modes of the effects, log_force (n,)."""

    minus2: np.ndarray
    log_force: np.ndarray


def no_effects(layout: Layout) -> np.ndarray:
    """Return effects (k,) of all places and presses that are 0, in units of their standard deviations."""
    return np.zeros(2 * (len(layout.place_start) - 1) + 2 * (len(layout.press_start) - 1))


def modes(
    layout: Layout, logs: np.ndarray, slopes: np.ndarray, start: float, step: float, log_young: float, spread: Spread,
    effects: np.ndarray | None = None,
) -> Modes:  # fmt: skip
    """Find the modes of all effects; return the likelihood of each place, and predictions with the modes.

    logs, slopes : (tables, depths) of log f and its slope over log depth, at the log depths start + k step
    effects : (k,) where the search starts, overwritten by the modes; those of nearby parameters save most iterations
    """
    result = Modes(np.empty(len(layout.place_start) - 1), np.empty(len(layout.depth_m)))
    effects = no_effects(layout) if effects is None else effects
    _all_places(*layout, logs, slopes, start, step, log_young, tuple(spread), effects, *result)
    return result


@numba.njit(cache=True, error_model="numpy")
def _log_force(logs, slopes, start, step, depth):
    """Interpolate log f of a table and its slope over depth at ``depth`` [m], by Hermite's cubic, linear beyond it."""
    if depth <= 0.0:
        return -700.0, 0.0
    position = (np.log(depth) - start) / step
    last = len(logs) - 1
    if position <= 0.0:
        return logs[0] + slopes[0] * position * step, slopes[0] / depth
    if position >= last:
        return logs[last] + slopes[last] * (position - last) * step, slopes[last] / depth
    k = int(position)
    t = position - k
    a, b, p, q = logs[k], logs[k + 1], slopes[k] * step, slopes[k + 1] * step
    value = a + t * (p + t * (3.0 * (b - a) - 2.0 * p - q + t * (2.0 * (a - b) + p + q)))
    slope = p + t * (2.0 * (3.0 * (b - a) - 2.0 * p - q) + t * 3.0 * (2.0 * (a - b) + p + q))
    return value, slope / (step * depth)


@numba.njit(cache=True, error_model="numpy")
def _solve(matrix, right, solution):
    """Solve a symmetric positive definite system in place by L D Lᵀ; return the log of its determinant."""
    size, log_det = len(right), 0.0
    for k in range(size):
        log_det += np.log(matrix[k, k])
        for a in range(k + 1, size):
            ratio = matrix[k, a] / matrix[k, k]
            for b in range(a, size):
                matrix[a, b] -= ratio * matrix[k, b]
            right[a] -= ratio * right[k]
    for k in range(size - 1, -1, -1):
        solution[k] = right[k]
        for b in range(k + 1, size):
            solution[k] -= matrix[k, b] * solution[b]
        solution[k] /= matrix[k, k]
    return log_det


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _all_places(
    depth_m, force_n, level, weight, press_start, place_start, table, logs, slopes, start, step, log_young, spread,
    effects, minus2, log_force,
):  # fmt: skip
    """Find the modes of the effects by the Gauss-Newton method, place by place; the last two arguments are the results.

    A place has 2 effects, a and b, and 2 for each of its presses, o and r; ``u`` holds them over their deviations.
    """
    noise, floor_n, place_sd, shape_sd, repeat_sd, offset, offset_sd, excess = spread
    asinh_measured, constant = np.empty(len(force_n)), np.empty(len(force_n))
    for i in range(len(force_n)):
        asinh_measured[i] = np.arcsinh(force_n[i] / floor_n)
        constant[i] = 2.0 * np.log(noise) + np.log(force_n[i] ** 2 + floor_n**2)  # by the derivative of asinh
    for place in range(len(place_start) - 1):
        first_press, end_press = place_start[place], place_start[place + 1]
        size = 2 + 2 * (end_press - first_press)
        place_effects = effects[2 * place + 2 * first_press : 2 * place + 2 * first_press + size]
        u, previous, newton_step, gradient = place_effects.copy(), np.zeros(size), np.zeros(size), np.zeros(size)
        hessian = np.zeros((size, size))  # upper half
        least, log_det = np.inf, 0.0
        for turn in range(2 * GAUSS_NEWTON_STEPS):
            total = 0.0  # −2 log density of the forces and the effects
            hessian[:] = 0.0
            for k in range(size):
                total += u[k] * u[k]
                hessian[k, k] = 1.0
                gradient[k] = -u[k]
            for press in range(first_press, end_press):
                o = 2 + 2 * (press - first_press)
                first_touch = offset + offset_sd * u[o]
                for i in range(press_start[press], press_start[press + 1]):
                    log_f, slope = _log_force(
                        logs[table[press]], slopes[table[press]], start, step, depth_m[i] - first_touch
                    )
                    log_m = log_young + log_f + place_sd * u[0] + (shape_sd * u[1] + excess) * level[i]
                    log_m += repeat_sd * u[o + 1]
                    log_force[i] = log_m
                    if weight[i] == 0.0:
                        continue
                    m = np.exp(min(log_m, 600.0))
                    residual = (asinh_measured[i] - np.arcsinh(m / floor_n)) / noise
                    total += residual * residual
                    # derivatives of log m by a, b, o and r, and of asinh(m/c)/σ by log m, which is then squared
                    da, db, do, dr = place_sd, shape_sd * level[i], -slope * offset_sd, repeat_sd
                    rate = m / (np.sqrt(m * m + floor_n * floor_n) * noise)
                    gradient[0] += rate * da * residual
                    gradient[1] += rate * db * residual
                    gradient[o] += rate * do * residual
                    gradient[o + 1] += rate * dr * residual
                    rate *= rate
                    hessian[0, 0] += rate * da * da
                    hessian[0, 1] += rate * da * db
                    hessian[1, 1] += rate * db * db
                    hessian[0, o] += rate * da * do
                    hessian[1, o] += rate * db * do
                    hessian[o, o] += rate * do * do
                    hessian[0, o + 1] += rate * da * dr
                    hessian[1, o + 1] += rate * db * dr
                    hessian[o, o + 1] += rate * do * dr
                    hessian[o + 1, o + 1] += rate * dr * dr
            if total > least + 1e-12 * (1.0 + least) and turn < 2 * GAUSS_NEWTON_STEPS - 1:  # too far: half the step
                u = 0.5 * (u + previous)
                continue
            log_det = _solve(hessian, gradient, newton_step)
            largest_move = np.abs(newton_step).max()
            if largest_move < STEP_TOLERANCE or turn >= GAUSS_NEWTON_STEPS:
                break
            least = total
            previous = u.copy()
            u = u + newton_step * min(1.0, LARGEST_STEP / largest_move)
        minus2[place] = total + log_det
        place_effects[:] = u
        for i in range(press_start[first_press], press_start[end_press]):
            minus2[place] += constant[i] * weight[i]
