"""Crossing of two triangles: the segment that they have in common."""

import math

import numba
import numpy as np

from palpate.collision.triangles.predicates import new_accumulator, orient3d
from palpate.collision.triangles.triangle_pair import (
    boxes_overlap,
    canonical_order,
    degenerate_segment,
    line_intersects,
    one_sided,
    plane_sides,
)
from palpate.collision.triangles.triangle_pairs import check_pairs, normalise


def crossing_segments(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find which triangles ``a[i]`` and ``b[i]`` cross, (n,) bool, and the ends (n, 2, 3) [m] of their common segment.

    a, b : (n, 3, 3) [m]
    The test, and the edges on which the ends lie, are exact; positions along these edges are rounded. Triangles in
    different planes that only touch count, with both ends in one place if they touch in a point, and so does a segment
    (a degenerate triangle) through a triangle. Coplanar triangles and two segments do not count: their ends are zero.
    Traps: the ends are ill-conditioned where the planes are nearly parallel, and they ignore coordinates below 1e-308
    of a pair's largest. Raises InputError as ``triangle_pairs_intersect`` does.
    """
    a, b = check_pairs(a, b)
    crossing, ends = np.zeros(len(a), dtype=bool), np.zeros((len(a), 2, 3))
    _find_crossings(a, b, crossing, ends)
    return crossing, ends


@numba.njit(cache=True)
def _find_crossings(a, b, crossing, ends):
    points, scaled, sums = np.empty((6, 3)), np.empty((6, 3)), new_accumulator()
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        crossing[n] = find_crossing(points, scaled, sums, ends[n])
        for end in range(2):
            for axis in range(3):
                ends[n, end, axis] = math.ldexp(ends[n, end, axis], exponent)


@numba.njit(cache=True)
def find_crossing(points, scaled, sums, ends):
    """Test whether a pair ``points`` (6, 3) crosses, as in ``crossing_segments``; if so, write ``ends`` (2, 3).

    The ends are those of ``scaled``, from ``normalise``.
    """
    if not boxes_overlap(points):
        return False
    of_a, of_b = plane_sides(points, 0, 3, sums), plane_sides(points, 3, 0, sums)
    flat_a, flat_b = of_b == (0, 0, 0), of_a == (0, 0, 0)
    if one_sided(of_a) or one_sided(of_b) or (flat_a and flat_b):
        return False
    if flat_a or flat_b:
        i, j, triangle = degenerate_segment(of_a, of_b)
        if not line_intersects(points, i, j, triangle, sums):
            return False
        _intersect_plane(scaled, i, j, triangle, ends[0])
        ends[1] = ends[0]
        return True
    p, q, r, u, v, w = canonical_order(of_a, of_b)
    if orient3d(points, p, q, u, v, sums) > 0 or orient3d(points, p, r, w, u, sums) > 0:
        return False
    # the later of both starts, and the earlier of both ends
    if orient3d(points, p, q, u, w, sums) > 0:
        _intersect_plane(scaled, p, q, 3, ends[0])
    else:
        _intersect_plane(scaled, u, w, 0, ends[0])
    if orient3d(points, p, r, u, v, sums) < 0:
        _intersect_plane(scaled, p, r, 3, ends[1])
    else:
        _intersect_plane(scaled, u, v, 0, ends[1])
    return True


@numba.njit(cache=True, error_model="numpy")
def _intersect_plane(points, i, j, triangle, point):
    """Write the point where the edge from i to j, with ends on both sides of a triangle's plane, crosses it."""
    plane = normal(points, triangle)
    low, high = height(points, triangle, plane, points[i]), height(points, triangle, plane, points[j])
    # rounding may have made both heights equal, or of equal sign
    fraction = min(max(low / (low - high), 0.0), 1.0) if low != high else 0.5
    # from the nearer end, so that no point lies beyond an end
    if fraction > 0.5:
        i, j, fraction = j, i, 1.0 - fraction
    for axis in range(3):
        point[axis] = points[i, axis] + fraction * (points[j, axis] - points[i, axis])


@numba.njit(cache=True)
def normal(points, first):
    """Compute the normal of the triangle from ``first`` on, as a tuple, of length twice its area."""
    a, b, c = points[first], points[first + 1], points[first + 2]
    ux, uy, uz, vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@numba.njit(cache=True)
def height(points, first, along, point):
    """Compute the distance of ``point`` from point ``first`` along a direction, times the direction's length."""
    x, y, z = point[0] - points[first, 0], point[1] - points[first, 1], point[2] - points[first, 2]
    return x * along[0] + y * along[1] + z * along[2]
