"""Closest points of a stencil's two parts, a point and a triangle or two edges, of any shape.

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
    """Find weights, distance [m] and duality gap of the minimum over both parameters; e : nodes less the first [m].

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
    length_e, length_f = np.sqrt(dot(e, e)), np.sqrt(dot(f, f))
    if not (length_e > 0.0 and length_f > 0.0):
        return 0.0, 0.0, 0.0
    e = (e[0] / length_e, e[1] / length_e, e[2] / length_e)
    along = dot(e, f)
    f = (f[0] - along * e[0], f[1] - along * e[1], f[2] - along * e[2])
    perpendicular = np.sqrt(dot(f, f))
    if not perpendicular > THIN * length_f:
        return 0.0, 0.0, 0.0
    f = (f[0] / perpendicular, f[1] / perpendicular, f[2] / perpendicular)
    s = dot(e, r)
    t = dot(f, (r[0] - s * e[0], r[1] - s * e[1], r[2] - s * e[2])) / perpendicular
    return (s - along * t) / length_e, t, perpendicular / length_f


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


POINT_TRIANGLE, EDGE_EDGE = 0, 1
"""Kinds of a stencil of four nodes: a point p and a triangle a b c, or an edge a b and an edge c d."""


@numba.njit(cache=True, error_model="numpy")
def closest(kind, x, nodes, weights):
    """Find the distance [m] of a stencil's two parts at positions ``x`` (n, 3) [m], and the number of free parameters.

    weights : (4,), overwritten: the shortest vector from the second part to the first is Σ wᵢ xᵢ, so w is
        (1, −u, −v, −w) for a point and a triangle, (1−s, s, t−1, −t) for two edges, with exact zeros where the
        closest point lies on a boundary. Parameters that no boundary fixes are free.

    The interior minimum is found by orthogonalising the two directions, those on the boundary by clamping; the nearest
    is chosen. Where rounding makes them equal, as distances are flat at a minimum, it is the one with the least duality
    gap, |r|² − min r·(xᵢ − xⱼ) over the nodes i of one part and j of the other, which is zero only at the minimum and
    not flat there. So needles, segments or points in place of a triangle, and parallel edges, need no special cases.
    """
    # all as differences to the first node, free of the rounding of large coordinates
    e1, e2, e3 = difference(x, nodes[1], nodes[0]), difference(x, nodes[2], nodes[0]), difference(x, nodes[3], nodes[0])
    best, length, gap = closest_inside(kind, e1, e2, e3)
    if length > 0.0:
        best = closest_on_boundary(kind, e1, e2, e3, best, length, gap)
    free = -2
    for i in range(4):
        weights[i] = best[i]
        free += best[i] != 0.0
    r = combine(best, e1, e2, e3)
    return np.sqrt(dot(r, r)), free


@numba.njit(cache=True, error_model="numpy")
def closest_points(kinds, nodes, x):
    """Compute distances (k,) [m], weights (k, 4) as in ``closest`` and unit normals (k, 3) of stencils.

    A normal points from the second part (the triangle, the edge c d) to the first. Trap: where the two parts touch
    there is none, and it is zero.
    """
    out, weights, normals = np.empty(len(kinds)), np.empty((len(kinds), 4)), np.zeros((len(kinds), 3))
    for k in range(len(kinds)):
        out[k], _ = closest(kinds[k], x, nodes[k], weights[k])
        r = separation(x, nodes[k], weights[k])
        if out[k] > 0.0:
            for i in range(3):
                normals[k, i] = r[i] / out[k]
    return out, weights, normals


@numba.njit(cache=True)
def separation(x, nodes, weights):
    """Compute Σ wᵢ xᵢ as a tuple [m], without the rounding of coordinates much larger than their differences."""
    e1, e2, e3 = difference(x, nodes[1], nodes[0]), difference(x, nodes[2], nodes[0]), difference(x, nodes[3], nodes[0])
    return combine((weights[0], weights[1], weights[2], weights[3]), e1, e2, e3)


@numba.njit(cache=True)
def boxes_apart(kind, x, nodes, reach):
    """Test whether the boxes of a stencil's two parts already show that these are more than ``reach`` [m] apart."""
    n_first = kind + 1
    for i in range(3):
        low, high = x[nodes[0], i], x[nodes[0], i]
        if n_first == 2:
            low, high = min(low, x[nodes[1], i]), max(high, x[nodes[1], i])
        other_low, other_high = x[nodes[3], i], x[nodes[3], i]
        for j in range(n_first, 3):
            other_low, other_high = min(other_low, x[nodes[j], i]), max(other_high, x[nodes[j], i])
        if other_low - high > reach or low - other_high > reach:
            return True
    return False
