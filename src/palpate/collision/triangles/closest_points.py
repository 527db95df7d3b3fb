"""Closest points of a point and a triangle, or of two edges, of any shape."""

import numba
import numpy as np

from palpate.collision.triangles.closest_weights import closest_inside, closest_on_boundary, combine, difference, dot

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
    ends = kind + 1
    for i in range(3):
        low, high = x[nodes[0], i], x[nodes[0], i]
        if ends == 2:
            low, high = min(low, x[nodes[1], i]), max(high, x[nodes[1], i])
        other_low, other_high = x[nodes[3], i], x[nodes[3], i]
        for j in range(ends, 3):
            other_low, other_high = min(other_low, x[nodes[j], i]), max(other_high, x[nodes[j], i])
        if other_low - high > reach or low - other_high > reach:
            return True
    return False
