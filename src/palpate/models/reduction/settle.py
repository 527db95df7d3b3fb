"""Find the coordinates of a reduced model under a load: one compiled function, without a matrix to factor."""

import numba
import numpy as np

from palpate.effects import principal
from palpate.effects.corotational import stresses

MEMORY = 10
"""Steps that the inverse Hessian is improved by."""


@numba.njit(cache=True, error_model="numpy")
def cell_stresses(q, slopes, volumes, mu, lam, shape, measure, volume, f, p, energies, sure):
    """Write F (9, k) of k cells and their stresses times volumes (9, k) [J] into ``f, p``; return their energy [J].

    q : (r,); slopes : (9 k, r); energies, sure : (k,) scratch; shape, measure, volume : of the law, or None
    """
    count = len(volumes)
    moved = np.dot(slopes, q)
    for i in range(9):
        one = 1.0 if i % 4 == 0 else 0.0
        for k in range(count):
            f[i, k] = moved[i * count + k] + one
    if shape is None:
        stresses(f, p, count, mu, lam, energies, sure)
    else:
        principal.stresses(f, p, count, 1, mu, lam, shape, measure, volume, energies)
    total = 0.0
    for k in range(count):
        total += volumes[k] * energies[k]
    for i in range(9):
        for k in range(count):
            p[i, k] *= volumes[k]
    return total


@numba.njit(cache=True, error_model="numpy")
def pulled_by_each(p, slopes, pulls):
    """Write what each of k cells adds to the gradient into ``pulls`` (k, r); p : (9, k) [J]; slopes : (9, k, r)."""
    pulls[:] = 0.0
    for i in range(9):
        for k in range(pulls.shape[0]):
            for j in range(pulls.shape[1]):
                pulls[k, j] += p[i, k] * slopes[i, k, j]


@numba.njit(cache=True, error_model="numpy")
def settle(load, slopes, volumes, mu, lam, rest, shape, measure, volume, tolerance, iterations, q):
    """Minimise Σ Ψ(F(q)) V + ½ qᵀ rest q − load · q from ``q`` (r,) in place, by L-BFGS that starts from the identity.

    load : (r,); rest : (r, r), what the cells' energy lacks at rest; the others as in ``cell_stresses``
    The coordinates are those in which the whole stiffness at rest is the identity, so that one step answers small
    loads. Returns the residual over the load, the smallest det F of the cells, and the energies computed. The residual
    is above ``tolerance`` where the search has ended without one.
    """
    r, count = len(load), len(volumes)
    steps, bends, scale, part = np.zeros((MEMORY, r)), np.zeros((MEMORY, r)), np.zeros(MEMORY), np.zeros(MEMORY)
    f, p, energies, sure = np.empty((9, count)), np.empty((9, count)), np.empty(count), np.empty(count, dtype=np.bool_)
    cells = (slopes, volumes, mu, lam, shape, measure, volume, f, p, energies, sure)
    enough = tolerance * np.sqrt(np.dot(load, load))
    pull = np.dot(rest, q)
    energy = cell_stresses(q, *cells) + 0.5 * np.dot(q, pull) - np.dot(load, q)
    gradient = np.dot(p.ravel(), slopes) + pull - load
    kept, calls = 0, 1
    for _ in range(iterations):
        if np.sqrt(np.dot(gradient, gradient)) <= enough:
            break
        ahead = -gradient
        oldest = max(0, kept - MEMORY)
        for j in range(kept - 1, oldest - 1, -1):
            m = j % MEMORY
            part[m] = scale[m] * np.dot(steps[m], ahead)
            ahead -= part[m] * bends[m]
        for j in range(oldest, kept):
            m = j % MEMORY
            ahead += (part[m] - scale[m] * np.dot(bends[m], ahead)) * steps[m]
        slope, length, found = -np.dot(gradient, ahead), 1.0, False
        while slope > 0.0 and length > 1e-4:
            reached = q + length * ahead
            pull = np.dot(rest, reached)
            lower = cell_stresses(reached, *cells) + 0.5 * np.dot(reached, pull) - np.dot(load, reached)
            calls += 1
            if lower <= energy - 1e-4 * length * slope + 1e-12 * abs(energy):
                found = True
                break
            length *= 0.5
        if not found:
            if kept == 0:
                break
            kept = 0
            continue
        bent = np.dot(p.ravel(), slopes) + pull - load
        m = kept % MEMORY
        steps[m], bends[m] = reached - q, bent - gradient
        curvature = np.dot(steps[m], bends[m])
        if curvature > 0.0:
            scale[m] = 1.0 / curvature
            kept += 1
        q[:], gradient[:], energy = reached, bent, lower
    left = np.sqrt(np.dot(gradient, gradient)) / max(np.sqrt(np.dot(load, load)), 1e-300)
    return left, _least_det(q, slopes, count), calls


@numba.njit(cache=True, error_model="numpy")
def _least_det(q, slopes, count):
    moved, least = np.dot(slopes, q), np.inf
    for k in range(count):
        a, b, c = moved[k] + 1.0, moved[count + k], moved[2 * count + k]
        d, e, g = moved[3 * count + k], moved[4 * count + k] + 1.0, moved[5 * count + k]
        h, i, j = moved[6 * count + k], moved[7 * count + k], moved[8 * count + k] + 1.0
        least = min(least, a * (e * j - g * i) - b * (d * j - g * h) + c * (d * i - e * h))
    return least
