"""Likelihood of presses whose places differ: a mixed-effects model with conditional modes and Laplace's approximation.

The force F of a press at depth d is  asinh(F/c) = asinh(m/c) + σ ε,  log m = log E + log f(d − o) + a + b l + e l,
l = log(d/d₀), with ε standard normal: noise of the share σ at large forces, and σ c at small ones. The offset o of first
touch is normal over presses; the level a and the exponent b are normal over places; e is common to all. Modes of the
effects given the forces are found by Gauss and Newton, and the integral over them is Laplace's (Lindstrom and Bates,
Biometrics 46, 1990; Pinheiro and Bates, J. Comput. Graph. Stat. 4, 1995).
"""

from typing import NamedTuple

import numba
import numpy as np

STEPS, STEP_TOLERANCE = 25, 1e-7
"""Most steps to the modes of a place's effects, and the step in their deviations that ends them."""
LARGEST_STEP = 2.0
"""Of an effect, in its standard deviations."""


class Layout(NamedTuple):
    """Which points belong to which press and place.

    depth_m, force_n, level : (n,) points, press after press, place after place; level is log(d/d₀)
    weight : (n,) 1 where a force is used, 0 where it is to be predicted
    press_start : (presses + 1,), place_start : (places + 1,) into the presses; table : (presses,)
    """

    depth_m: np.ndarray
    force_n: np.ndarray
    level: np.ndarray
    weight: np.ndarray
    press_start: np.ndarray
    place_start: np.ndarray
    table: np.ndarray


class Spread(NamedTuple):
    """Noise and what differs between presses; deviations are of log force, of the exponent, and of offsets [m].

    noise : share σ; floor_n : c [N]; place, shape : of places; repeat : of log force between presses of a place
    offset_m, offset_scatter_m : mean and deviation over presses; excess : common exponent e
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
    """Result: minus2 (places,) of −2 log likelihood; log_force (n,) with the effects' modes; offset_m (presses,)."""

    minus2: np.ndarray
    log_force: np.ndarray
    offset_m: np.ndarray


def modes(
    layout: Layout, logs: np.ndarray, slopes: np.ndarray, start: float, step: float, log_young: float, spread: Spread
) -> Modes:
    """Return the likelihood of each place, and predictions with the effects' modes.

    logs, slopes : (tables, depths) of log f and its slope over log depth, at start + k step
    """
    places, n = len(layout.place_start) - 1, len(layout.depth_m)
    found = Modes(np.empty(places), np.empty(n), np.empty(len(layout.press_start) - 1))
    _all_places(*layout, logs, slopes, start, step, log_young, tuple(spread), *found)
    return found


@numba.njit(cache=True, error_model="numpy")
def _log_force(logs, slopes, start, step, depth):
    """Return log f and its slope over depth by Hermite's cubic; straight over log depth beyond both ends."""
    if depth <= 0.0:
        return -700.0, 0.0
    at = (np.log(depth) - start) / step
    last = len(logs) - 1
    if at <= 0.0:
        return logs[0] + slopes[0] * at * step, slopes[0] / depth
    if at >= last:
        return logs[last] + slopes[last] * (at - last) * step, slopes[last] / depth
    k = int(at)
    t = at - k
    a, b, p, q = logs[k], logs[k + 1], slopes[k] * step, slopes[k + 1] * step
    value = a + t * (p + t * (3.0 * (b - a) - 2.0 * p - q + t * (2.0 * (a - b) + p + q)))
    slope = p + t * (2.0 * (3.0 * (b - a) - 2.0 * p - q) + t * 3.0 * (2.0 * (a - b) + p + q))
    return value, slope / (step * depth)


@numba.njit(cache=True, error_model="numpy")
def _all_places(
    depth_m, force_n, level, weight, press_start, place_start, table, logs, slopes, start, step, log_young, spread,
    minus2, log_force, offset_m,
):  # fmt: skip
    noise, floor_n, place_sd, shape_sd, repeat_sd, offset, offset_sd, excess = spread
    for g in range(len(place_start) - 1):
        first, end = place_start[g], place_start[g + 1]
        size = 2 + 2 * (end - first)
        u, old, grad = np.zeros(size), np.zeros(size), np.zeros(size)
        hessian = np.eye(size)
        best = np.inf
        for turn in range(STEPS + 20):
            total, constant = 0.0, 0.0
            for k in range(size):
                total += u[k] * u[k]
            hessian[:] = np.eye(size)
            grad[:] = -u
            for press in range(first, end):
                o = 2 + 2 * (press - first)
                at = offset + offset_sd * u[o]
                offset_m[press] = at
                for i in range(press_start[press], press_start[press + 1]):
                    log_f, slope = _log_force(logs[table[press]], slopes[table[press]], start, step, depth_m[i] - at)
                    log_m = log_young + log_f + place_sd * u[0] + (shape_sd * u[1] + excess) * level[i]
                    log_m += repeat_sd * u[o + 1]
                    log_force[i] = log_m
                    if weight[i] == 0.0:
                        continue
                    m = np.exp(min(log_m, 600.0))
                    root = np.hypot(m, floor_n)
                    r = (np.arcsinh(force_n[i] / floor_n) - np.arcsinh(m / floor_n)) / noise
                    gain = m / root / noise
                    j0, j1, j2, j3 = gain * place_sd, gain * shape_sd * level[i], -gain * slope * offset_sd, gain * repeat_sd
                    total += r * r
                    constant += 2.0 * np.log(noise) + 2.0 * np.log(np.hypot(force_n[i], floor_n))
                    grad[0] += j0 * r
                    grad[1] += j1 * r
                    grad[o] += j2 * r
                    grad[o + 1] += j3 * r
                    hessian[0, 0] += j0 * j0
                    hessian[0, 1] += j0 * j1
                    hessian[1, 1] += j1 * j1
                    hessian[0, o] += j0 * j2
                    hessian[1, o] += j1 * j2
                    hessian[o, o] += j2 * j2
                    hessian[0, o + 1] += j0 * j3
                    hessian[1, o + 1] += j1 * j3
                    hessian[o, o + 1] += j2 * j3
                    hessian[o + 1, o + 1] += j3 * j3
            for a in range(size):
                for b in range(a):
                    hessian[a, b] = hessian[b, a]
            if total > best + 1e-9 * (1.0 + abs(best)) and turn < STEPS + 19:  # too far: half way back
                u = 0.5 * (u + old)
                continue
            move = np.linalg.solve(hessian, grad)
            farthest = np.abs(move).max()
            if farthest < STEP_TOLERANCE or turn >= STEPS:
                break
            best = total
            old = u.copy()
            u = u + move * min(1.0, LARGEST_STEP / farthest)
        minus2[g] = total + constant + np.linalg.slogdet(hessian)[1]
