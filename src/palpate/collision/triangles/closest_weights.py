"""Barycentric weights at which the two parts of a stencil are closest: candidates, and the choice among them.

Vectors are tuples here; e₁, e₂, e₃ are the differences of a stencil's last three nodes to its first;
its kind is 0 for a point and a triangle, 1 for two edges.
"""

import numba
import numpy as np

THIN = 1e-14
"""Sine of the angle below which two directions count as parallel: rounding hides any component across."""

ROUNDING = 1e-15
"""Rounding error of a distance, relative to the stencil's size."""


@numba.njit(cache=True)
def difference(x, i, j):
    """Compute xᵢ − xⱼ of positions ``x`` (n, 3)."""
    return (x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2])


@numba.njit(cache=True)
def _subtract(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@numba.njit(cache=True)
def dot(a, b):
    """Compute the inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True)
def combine(w, e1, e2, e3):
    """Compute Σ wᵢ xᵢ for weights that sum to 0."""
    return (
        w[1] * e1[0] + w[2] * e2[0] + w[3] * e3[0],
        w[1] * e1[1] + w[2] * e2[1] + w[3] * e3[1],
        w[1] * e1[2] + w[2] * e2[2] + w[3] * e3[2],
    )


@numba.njit(cache=True)
def closest_inside(kind, e1, e2, e3):
    """Find the weights of the minimum over both parameters, its distance [m] and its duality gap.

    Distance and gap are inf if the minimum is outside or does not exist, and 0 where the shape leaves no doubt.
    """
    if kind == 0:
        s, t, sine = _least_squares((-e1[0], -e1[1], -e1[2]), _subtract(e2, e1), _subtract(e3, e1))
        best, inside = (1.0, s + t - 1.0, -s, -t), min(s, t, 1.0 - s - t) > 0.0
    else:
        s, t, sine = _least_squares(e2, e1, _subtract(e2, e3))
        best, inside = (1.0 - s, s, t - 1.0, -t), min(s, t, 1.0 - s, 1.0 - t) > 0.0
    if not (inside and sine > THIN):
        return best, np.inf, np.inf
    if sine > 1e-3:
        return best, 0.0, 0.0
    length, gap = _distance_and_gap(kind, best, e1, e2, e3)
    return best, length, gap


@numba.njit(cache=True, error_model="numpy")
def _least_squares(r, e, f):
    """Find s and t with r ≈ s e + t f, and the sine of the angle between e and f."""
    first, second = np.sqrt(dot(e, e)), np.sqrt(dot(f, f))
    if not (first > 0.0 and second > 0.0):
        return 0.0, 0.0, 0.0
    e = (e[0] / first, e[1] / first, e[2] / first)
    along = dot(e, f)
    f = (f[0] - along * e[0], f[1] - along * e[1], f[2] - along * e[2])
    perpendicular = np.sqrt(dot(f, f))
    if not perpendicular > THIN * second:
        return 0.0, 0.0, 0.0
    f = (f[0] / perpendicular, f[1] / perpendicular, f[2] / perpendicular)
    s = dot(e, r)
    t = dot(f, (r[0] - s * e[0], r[1] - s * e[1], r[2] - s * e[2])) / perpendicular
    return (s - along * t) / first, t, perpendicular / second


@numba.njit(cache=True)
def closest_on_boundary(kind, e1, e2, e3, best, length, gap):
    """Choose among ``best``, at distance ``length`` [m] with ``gap``, and all closest points on an end or a side.

    The nearest is chosen; of several that differ by no more than rounding, the one with the least duality gap.
    """
    e0, rounding = (0.0, 0.0, 0.0), ROUNDING * np.sqrt(max(dot(e1, e1), dot(e2, e2), dot(e3, e3)))
    for side in range(3 if kind == 0 else 4):
        if kind == 0:
            if side == 0:
                t = _edge_parameter(e0, e1, e2)
                candidate = (1.0, t - 1.0, -t, 0.0)
            elif side == 1:
                t = _edge_parameter(e0, e2, e3)
                candidate = (1.0, 0.0, t - 1.0, -t)
            else:
                t = _edge_parameter(e0, e3, e1)
                candidate = (1.0, -t, 0.0, t - 1.0)
        elif side < 2:
            t = _edge_parameter(e1 if side else e0, e2, e3)
            candidate = (1.0 - side, float(side), t - 1.0, -t)
        else:
            s = _edge_parameter(e3 if side == 3 else e2, e0, e1)
            candidate = (1.0 - s, s, side - 3.0, 2.0 - side)
        candidate_length, candidate_gap = _distance_and_gap(kind, candidate, e1, e2, e3)
        if candidate_length < length - rounding or (candidate_length <= length + rounding and candidate_gap < gap):
            best, length, gap = candidate, candidate_length, candidate_gap
    return best


@numba.njit(cache=True, error_model="numpy")
def _edge_parameter(p, a, b):
    """Find the parameter in [0, 1] of the point closest to p on the edge from a to b; 0 if it has no length."""
    e = _subtract(b, a)
    square = dot(e, e)
    return min(max(dot(_subtract(p, a), e) / square, 0.0), 1.0) if square > 0.0 else 0.0


@numba.njit(cache=True)
def _distance_and_gap(kind, weights, e1, e2, e3):
    """Compute |r| and the duality gap |r|² − min r·(xᵢ − xⱼ) over nodes i of one part and j of the other."""
    r = combine(weights, e1, e2, e3)
    square, along1, along2, along3 = dot(r, r), dot(r, e1), dot(r, e2), dot(r, e3)
    if kind == 0:
        return np.sqrt(square), square + max(along1, along2, along3)
    return np.sqrt(square), square - min(0.0, along1) + max(along2, along3)
