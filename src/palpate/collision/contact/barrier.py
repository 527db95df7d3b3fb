"""Barrier that keeps surfaces apart: an energy that acts within a gap and diverges as it closes."""

import numba
import numpy as np

from palpate.collision.contact.distance_hessian import add_curvature, add_outer
from palpate.collision.contact.mollifier import add_mixed, add_parallel_curvature, mollifier
from palpate.collision.triangles.closest_points import boxes_apart, closest, separation


@numba.njit(cache=True, error_model="numpy")
def barrier(s):
    """Compute b(s) = −(s − 1)² ln s for 0 < s < 1, and its first two derivatives (Li et al. 2020, eq. 6)."""
    log, rest = np.log(s), s - 1.0
    return -rest * rest * log, -2.0 * rest * log - rest * rest / s, -2.0 * log - 4.0 * rest / s + (rest / s) ** 2


@numba.njit(cache=True)
def energy(kinds, nodes, offsets, scales, mollify, gap, x):
    """Sum scale · gap · m · b((d − offset)/gap) [J] over stencils whose parts are less than ``gap`` [m] from touching.

    kinds : (k,) of POINT_TRIANGLE or EDGE_EDGE; nodes : (k, 4); offsets : (k,) [m] sums of the parts' radii;
    scales : (k,) [N]; mollify : (k,) [m⁴] from mollifier.thresholds; x : (n, 3) [m]
    +inf where parts touch or overlap. Li et al. 2020, eq. 5; in s, so that a force has the size of ``scale``.
    Trap: the energy of parallel edges is zero whatever their distance; their ends keep apart from the triangles
    beside the other edge, so pass both kinds of stencils.
    """
    weights, gradient, total = np.empty(4), np.empty((4, 3)), 0.0
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        s = (closest(kinds[k], x, nodes[k], weights)[0] - offsets[k]) / gap
        if s >= 1.0:
            continue
        if not s > 0.0:
            return np.inf
        total += scales[k] * gap * mollifier(x, nodes[k], mollify[k], gradient)[0] * barrier(s)[0]
    return total


@numba.njit(cache=True)
def add_force(kinds, nodes, offsets, scales, mollify, gap, x, force):
    """Add minus the energy's gradient to ``force`` (n, 3) [N]; nothing where parts touch or overlap and it has none."""
    weights, gradient = np.empty(4), np.empty((4, 3))
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        distance, _ = closest(kinds[k], x, nodes[k], weights)
        s = (distance - offsets[k]) / gap
        if not 0.0 < s < 1.0:
            continue
        factor, by_c, _ = mollifier(x, nodes[k], mollify[k], gradient)
        value, slope, _ = barrier(s)
        r = separation(x, nodes[k], weights)
        push = -scales[k] * factor * slope / distance
        for a in range(4):
            for i in range(3):
                force[nodes[k, a], i] += push * weights[a] * r[i]
                if by_c != 0.0:
                    force[nodes[k, a], i] -= scales[k] * gap * value * by_c * gradient[a, i]


@numba.njit(cache=True)
def blocks(kinds, nodes, offsets, scales, mollify, gap, x, definite):
    """Find the active stencils, (a,), and the energy's second derivatives by their nodes, (a, 4, 4, 3, 3) [N/m].

    The exact Hessian; with ``definite`` a positive semi-definite part of it, which lacks only negative terms.
    Where a row of ``nodes`` has a node twice, the blocks of both places belong to it.
    """
    weights, active, levels = np.empty((len(kinds), 4)), np.empty(len(kinds), np.int64), np.empty(len(kinds))
    count = 0
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        s = (closest(kinds[k], x, nodes[k], weights[count])[0] - offsets[k]) / gap
        if 0.0 < s < 1.0:
            active[count], levels[count] = k, s
            count += 1
    out = np.zeros((count, 4, 4, 3, 3))
    for a in range(count):
        k = active[a]
        _fill(kinds[k], nodes[k], scales[k], mollify[k], gap, x, weights[a], levels[a], definite, out[a])
    return active[:count], out


@numba.njit(cache=True, error_model="numpy")
def _fill(kind, nodes, scale, threshold, gap, x, weights, s, definite, block):
    gradient, normals = np.empty((4, 3)), np.empty((4, 3))
    factor, by_c, by_cc = mollifier(x, nodes, threshold, gradient)
    value, slope, curvature = barrier(s)
    r = np.array(separation(x, nodes, weights))
    r /= np.sqrt(np.sum(r * r))
    for a in range(4):
        normals[a] = weights[a] * r
    add_curvature(kind, x, nodes, weights, -scale * factor * slope, definite, block)
    if by_cc == 0.0:
        add_outer(scale * curvature / gap, normals, normals, block)
        return
    of_both, of_parallel = scale * slope * by_c, scale * gap * value * by_cc
    add_mixed(scale * factor * curvature / gap, of_both, of_parallel, normals, gradient, definite, block)
    add_parallel_curvature(x, nodes, scale * gap * value * by_c, definite, block)
