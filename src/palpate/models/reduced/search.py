"""Minimise the energy of a body in few coordinates, compiled: by L-BFGS under forces, by Newton under an instrument.

x = X + Φ q with ΦᵀKΦ = I at rest, so that a step along the gradient is the linear response. An instrument is a penalty
at points of the surface: few modes cannot follow it at all of them, and multipliers would press where modes fail.
"""

import numba
import numpy as np

from palpate.effects.instrument import curvatures, distances
from palpate.models.reduced.cholesky import factor, solve
from palpate.models.reduced.cubature_points import add_tangent, elastic, scratch_of

MEMORY = 10
"""Steps that the inverse Hessian is improved by."""


@numba.njit(cache=True, error_model="numpy")
def settle(q, load, body, touch, tolerance, iterations):
    """Minimise elastic energy less load · q, or plus that of contact, from ``q`` (r,) in place; return the residual.

    load : (r,); body : as ``elastic`` takes it; touch : None, or what ``touched`` and ``newton`` take, without a load
    The method is L-BFGS from the identity under a load, and Newton's under an instrument. The residual is relative to
    the load or the pull of contact, and above ``tolerance`` where the search ended without a minimum.
    """
    scratch, no_factor = scratch_of(body), np.empty((0, 0))
    steps, turns, scale = np.empty((MEMORY, len(q))), np.empty((MEMORY, len(q))), np.empty(MEMORY)
    energy, gradient, scale_n = valued(q, load, body, scratch, touch)
    residual, stored = np.inf, 0
    for iteration in range(iterations + 1):
        norm = np.sqrt(np.dot(gradient, gradient))
        residual = 0.0 if norm == 0.0 else norm / scale_n
        if residual <= tolerance or iteration == iterations:
            break
        if touch is None:
            direction = directed(no_factor, -gradient, steps, turns, scale, stored)
        else:
            direction = newton(q, -gradient, body, touch)
        slope, length, accepted = np.dot(gradient, direction), 1.0, False
        while slope < 0.0 and length > 1e-4:  # halve the step until the energy falls
            trial = q + length * direction
            trial_energy, trial_gradient, pull = valued(trial, load, body, scratch, touch)
            if trial_energy <= energy + 1e-4 * length * slope + 1e-12 * abs(energy):
                accepted = True
                break
            length *= 0.5
        if accepted:
            if touch is None:
                stored = remember(trial - q, trial_gradient - gradient, steps, turns, scale, stored)
            q[:], gradient, energy = trial, trial_gradient, trial_energy
            scale_n = pull if pull > 0.0 else scale_n
        elif stored > 0:  # once more along the gradient
            stored = 0
        else:
            break
    return residual


@numba.njit(cache=True, error_model="numpy")
def valued(q, load, body, scratch, touch):
    """Return the energy [J] that ``settle`` minimises, its gradient (r,), and the norm of the load or the pull."""
    energy, gradient = elastic(q, body, scratch)
    if touch is None:
        return energy - np.dot(load, q), gradient - load, np.sqrt(np.dot(load, load))
    stored, pull = touched(q, touch)
    return energy + stored, gradient - pull, np.sqrt(np.dot(pull, pull))


@numba.njit(cache=True, error_model="numpy")
def remember(step, turn, steps, turns, scale, kept):
    """Store a ``step`` and the gradient's change ``turn`` over it for L-BFGS; return how many pairs were stored so far.

    steps, turns, scale : where the last pairs and the inverses of their products are; a pair of negative curvature is
        left out
    """
    slot, curvature = kept % len(steps), np.dot(step, turn)
    if not curvature > 0.0:
        return kept
    steps[slot], turns[slot], scale[slot] = step, turn, 1.0 / curvature
    return kept + 1


@numba.njit(cache=True, error_model="numpy")
def directed(factored, right, steps, turns, scale, kept):
    """Return the L-BFGS estimate of the inverse Hessian times ``right`` (n,) (Nocedal and Wright 2006, algorithm 7.4).

    factored : the Cholesky factor (n, n) of the Hessian that the estimate starts from, or (0, 0) for the identity
    steps, turns, scale, kept : as of ``remember``
    """
    direction, size = right.copy(), len(steps)
    projections, oldest = np.empty(size), max(0, kept - size)
    for j in range(kept - 1, oldest - 1, -1):  # from the last pair to the oldest
        slot = j % size
        projections[slot] = scale[slot] * np.dot(steps[slot], direction)
        direction -= projections[slot] * turns[slot]
    if len(factored):
        solve(factored, direction)
    for j in range(oldest, kept):
        slot = j % size
        direction += (projections[slot] - scale[slot] * np.dot(turns[slot], direction)) * steps[slot]
    return direction


@numba.njit(cache=True, error_model="numpy")
def touched(q, touch):
    """Return the energy [J] and the pull (r,) on coordinates of an instrument's penalty at points, at ``q`` (r,).

    touch : ``base`` (r, r), the part of the tangent that does not change; of p points places at rest (3 p,) [m], modes
        (3 p, r), areas (p,) [m²] and penalties (p,) [Pa/m]; an instrument's tip, axes and shape; places, gaps, normals
        and pressures of the points, which are written
    """
    _, rest, modes, areas, penalty, tip, axes, shape, places, gaps, normals, pressures = touch
    now, energy, pull = rest + np.dot(modes, q), 0.0, np.zeros(len(q))
    for n in range(len(areas)):
        for i in range(3):
            places[n, i] = now[3 * n + i]
    distances(places, tip, axes, shape, gaps, normals)
    for n in range(len(areas)):
        pressures[n] = max(-penalty[n] * gaps[n], 0.0)
        if pressures[n] > 0.0:
            energy += 0.5 * areas[n] * pressures[n] ** 2 / penalty[n]
            for i in range(3):
                push = areas[n] * pressures[n] * normals[n, i]
                for h in range(len(q)):
                    pull[h] += push * modes[3 * n + i, h]
    return energy, pull


@numba.njit(cache=True, error_model="numpy")
def newton(q, right, body, touch):
    """Return the inverse of the tangent at ``q`` (r,) times ``right`` (r,), where ``touched`` was evaluated last.

    Where the tangent is not positive definite, as where the body buckles or is inverted, its stiffness at rest, the
    identity, takes its place.
    """
    slopes, volumes, mu, lam, _, law, measure, volume = body
    base, _, modes, areas, penalty, tip, axes, shape, places, gaps, normals, pressures = touch
    r, pressed = len(q), np.flatnonzero(pressures > 0.0)
    rows, stiff_rows, curvature = np.empty((3 * len(pressed), r)), np.empty((3 * len(pressed), r)), np.empty((1, 3, 3))
    step = right.copy()
    for curved in (True, False):  # with the tangent, or without what may make it indefinite
        for j in range(len(pressed)):  # contact's stiffness times modes, point by point
            n = pressed[j]
            only = slice(n, n + 1)
            curvatures(places[only], tip, axes, shape, gaps[only], normals[only], curvature)
            push, stiff_n = areas[n] * pressures[n] if curved else 0.0, areas[n] * penalty[n]
            for i in range(3):
                rows[3 * j + i] = modes[3 * n + i]
                a = stiff_n * normals[n, i] * normals[n, 0] - push * curvature[0, i, 0]
                b = stiff_n * normals[n, i] * normals[n, 1] - push * curvature[0, i, 1]
                c = stiff_n * normals[n, i] * normals[n, 2] - push * curvature[0, i, 2]
                for h in range(r):
                    stiff_rows[3 * j + i, h] = a * modes[3 * n, h] + b * modes[3 * n + 1, h] + c * modes[3 * n + 2, h]
        tangent = np.dot(rows.T, stiff_rows)
        if curved:
            tangent += base
            for block in range(len(slopes)):
                points = slopes[block].reshape(9, volumes.shape[1], r), volumes[block], mu[block], lam[block]
                add_tangent(q, *points, law, measure, volume, tangent)
        else:
            tangent += np.eye(r)
        if factor(tangent):
            solve(tangent, step)
            break
    return step
