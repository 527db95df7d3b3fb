"""The weights at which two parts of a stencil are closest: candidates, and how to tell the right one.

Vectors are tuples here; e₁, e₂, e₃ are the differences of a stencil's last three nodes to its first;
its kind is 0 for a point and a triangle, 1 for two edges.
"""

import numba
import numpy as np

THIN = 1e-14
"""Sine of the angle below which two directions are one: rounding leaves nothing of what is across."""

ROUNDING = 1e-15
"""What rounding may change of a distance, in parts of the stencil's size."""


@numba.njit(cache=True)
def minus(x, i, j):
    """xᵢ − xⱼ of positions ``x`` (n, 3)."""
    return (x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2])


@numba.njit(cache=True)
def _less(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@numba.njit(cache=True)
def dot(a, b):
    """The inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True)
def combine(w, e1, e2, e3):
    """Σ wᵢ xᵢ of weights that add up to 0."""
    return (
        w[1] * e1[0] + w[2] * e2[0] + w[3] * e3[0],
        w[1] * e1[1] + w[2] * e2[1] + w[3] * e3[1],
        w[1] * e1[2] + w[2] * e2[2] + w[3] * e3[2],
    )


@numba.njit(cache=True)
def closest_inside(kind, e1, e2, e3):
    """The weights of the minimum over both parameters, their distance [m] and gap: inf if outside, or there is none.

    A distance and a gap of zero where the shape leaves no doubt.
    """
    if kind == 0:
        s, t, sine = _least_squares((-e1[0], -e1[1], -e1[2]), _less(e2, e1), _less(e3, e1))
        best, inside = (1.0, s + t - 1.0, -s, -t), min(s, t, 1.0 - s - t) > 0.0
    else:
        s, t, sine = _least_squares(e2, e1, _less(e2, e3))
        best, inside = (1.0 - s, s, t - 1.0, -t), min(s, t, 1.0 - s, 1.0 - t) > 0.0
    if not (inside and sine > THIN):
        return best, np.inf, np.inf
    if sine > 1e-3:
        return best, 0.0, 0.0
    length, gap = _measure(kind, best, e1, e2, e3)
    return best, length, gap


@numba.njit(cache=True, error_model="numpy")
def _least_squares(r, e, f):
    """s and t with r ≈ s e + t f, and the sine of the angle between e and f."""
    first, second = np.sqrt(dot(e, e)), np.sqrt(dot(f, f))
    if not (first > 0.0 and second > 0.0):
        return 0.0, 0.0, 0.0
    e = (e[0] / first, e[1] / first, e[2] / first)
    along = dot(e, f)
    f = (f[0] - along * e[0], f[1] - along * e[1], f[2] - along * e[2])
    across = np.sqrt(dot(f, f))
    if not across > THIN * second:
        return 0.0, 0.0, 0.0
    f = (f[0] / across, f[1] / across, f[2] / across)
    s = dot(e, r)
    t = dot(f, (r[0] - s * e[0], r[1] - s * e[1], r[2] - s * e[2])) / across
    return (s - along * t) / first, t, across / second


@numba.njit(cache=True)
def closest_on_boundary(kind, e1, e2, e3, best, length, gap):
    """The best of ``best``, ``length`` [m] apart with ``gap``, and of all closest points on an end or a side.

    The nearest; of several that differ by no more than rounding, that of the least gap.
    """
    e0, same = (0.0, 0.0, 0.0), ROUNDING * np.sqrt(max(dot(e1, e1), dot(e2, e2), dot(e3, e3)))
    for side in range(3 if kind == 0 else 4):
        if kind == 0:
            if side == 0:
                t = _along(e0, e1, e2)
                trial = (1.0, t - 1.0, -t, 0.0)
            elif side == 1:
                t = _along(e0, e2, e3)
                trial = (1.0, 0.0, t - 1.0, -t)
            else:
                t = _along(e0, e3, e1)
                trial = (1.0, -t, 0.0, t - 1.0)
        elif side < 2:
            t = _along(e1 if side else e0, e2, e3)
            trial = (1.0 - side, float(side), t - 1.0, -t)
        else:
            s = _along(e3 if side == 3 else e2, e0, e1)
            trial = (1.0 - s, s, side - 3.0, 2.0 - side)
        trial_length, trial_gap = _measure(kind, trial, e1, e2, e3)
        if trial_length < length - same or (trial_length <= length + same and trial_gap < gap):
            best, length, gap = trial, trial_length, trial_gap
    return best


@numba.njit(cache=True, error_model="numpy")
def _along(p, a, b):
    """Where on the edge from a to b, in [0, 1], the point closest to p lies; 0 if the edge has no length."""
    e = _less(b, a)
    square = dot(e, e)
    return min(max(dot(_less(p, a), e) / square, 0.0), 1.0) if square > 0.0 else 0.0


@numba.njit(cache=True)
def _measure(kind, weights, e1, e2, e3):
    """|r|, and the duality gap |r|² − min r·(xᵢ − xⱼ) over the nodes i of one part and j of the other."""
    r = combine(weights, e1, e2, e3)
    square, along1, along2, along3 = dot(r, r), dot(r, e1), dot(r, e2), dot(r, e3)
    if kind == 0:
        return np.sqrt(square), square + max(along1, along2, along3)
    return np.sqrt(square), square - min(0.0, along1) + max(along2, along3)
