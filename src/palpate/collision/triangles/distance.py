"""Distance of two triangles, and their closest points."""

import math

import numba
import numpy as np

from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, closest
from palpate.collision.triangles.intersection import check_pairs, find_crossing, normalise, triangles_intersect
from palpate.collision.triangles.predicates import new_accumulator

STENCILS = np.array(
    [(i, 3, 4, 5) for i in range(3)]
    + [(i, 0, 1, 2) for i in range(3, 6)]
    + [(i, (i + 1) % 3, 3 + j, 3 + (j + 1) % 3) for i in range(3) for j in range(3)]
)
"""Stencils of a pair's six points: each corner with the other triangle, and each edge of a with each of b."""


def triangle_pairs_distance(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute distances (n,) [m] of triangles ``a[i]`` and ``b[i]``, and the closest points on a and on b, (n, 3) [m].

    a, b : (n, 3, 3) [m]
    Those that intersect, by the exact test, have distance 0 and one point given twice: the middle of their segment if
    they cross. Trap: the distance is rounded, so it may be 0 for triangles that barely do not intersect. Raises
    InputError as ``triangle_pairs_intersect`` does.
    """
    return _measure(*check_pairs(a, b))


@numba.njit(cache=True)
def _pair_distance(points, scaled, sums, weights, nearest):
    """Compute the distance of ``scaled``, from ``normalise``; 0 where the pair ``points`` (6, 3) intersects.

    nearest : (2, 3), overwritten: the closest points on a and on b
    weights : (4,), overwritten
    """
    intersecting = triangles_intersect(points, sums)
    if intersecting and find_crossing(points, scaled, sums, nearest):
        for axis in range(3):
            nearest[:, axis] = 0.5 * (nearest[0, axis] + nearest[1, axis])
        return 0.0
    least = np.inf
    for n in range(len(STENCILS)):
        distance, _ = closest(POINT_TRIANGLE if n < 6 else EDGE_EDGE, scaled, STENCILS[n], weights)
        if distance < least:
            least = distance
            _write(scaled, STENCILS[n], weights, nearest)
    if intersecting:
        nearest[1], least = nearest[0], 0.0
    return least


@numba.njit(cache=True)
def _write(points, nodes, weights, closest):
    """Write the closest points of a stencil on a and on b into ``closest`` (2, 3)."""
    closest[:] = 0.0
    # the first part of a stencil has the positive weights, and may belong to b
    sign = 1.0 if nodes[0] < 3 else -1.0
    for axis in range(3):
        for i in range(4):
            if nodes[i] < 3:
                closest[0, axis] += sign * weights[i] * points[nodes[i], axis]
            else:
                closest[1, axis] -= sign * weights[i] * points[nodes[i], axis]


@numba.njit(cache=True)
def _measure(a, b):
    """Return what ``triangle_pairs_distance`` does, of contiguous arrays (n, 3, 3)."""
    distances, on_a, on_b = np.empty(len(a)), np.empty((len(a), 3)), np.empty((len(a), 3))
    points, scaled, sums = np.empty((6, 3)), np.empty((6, 3)), new_accumulator()
    weights, nearest = np.empty(4), np.empty((2, 3))
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        distances[n] = math.ldexp(_pair_distance(points, scaled, sums, weights, nearest), exponent)
        for axis in range(3):
            on_a[n, axis], on_b[n, axis] = (
                math.ldexp(nearest[0, axis], exponent),
                math.ldexp(nearest[1, axis], exponent),
            )
    return distances, on_a, on_b
