"""Where two triangles cross: the segment that they have in common."""

import math

import numba
import numpy as np

from palpate.collision.triangles.predicates import digits, orient3d
from palpate.collision.triangles.triangle_pair import boxes_meet, line_meets, ordered, parted, segment, sides
from palpate.collision.triangles.triangle_pairs import checked, normalise


def crossing_segments(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which triangles ``a[i]`` and ``b[i]`` cross, (n,) bool, and the ends (n, 2, 3) [m] of what they have in common.

    a, b : (n, 3, 3) [m]
    Whether they cross, and which edges the ends lie on, is exact; where on these edges is rounded. Triangles that only
    touch, in different planes, count, with both ends in one place if they touch in a point, and so does a segment (a
    triangle without area) through a triangle. Triangles in one plane do not, nor do two segments: their ends are zero.
    Traps: the ends are ill-conditioned where both planes are nearly one, and what is 1e-308 of a pair's largest
    coordinate is nothing to them. Raises InputError as ``triangle_pairs_intersect`` does.
    """
    a, b = checked(a, b)
    hit, ends = np.zeros(len(a), dtype=bool), np.zeros((len(a), 2, 3))
    _cross(a, b, hit, ends)
    return hit, ends


@numba.njit(cache=True)
def _cross(a, b, hit, ends):
    points, scaled, sums = np.empty((6, 3)), np.empty((6, 3)), digits()
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        hit[n] = cross(points, scaled, sums, ends[n])
        for end in range(2):
            for axis in range(3):
                ends[n, end, axis] = math.ldexp(ends[n, end, axis], exponent)


@numba.njit(cache=True)
def cross(points, scaled, sums, ends):
    """Whether a pair ``points`` (6, 3) crosses, as ``crossing_segments`` says; if so, ``ends`` (2, 3) are overwritten.

    They are those of ``scaled``, from ``normalise``.
    """
    if not boxes_meet(points):
        return False
    of_a, of_b = sides(points, 0, 3, sums), sides(points, 3, 0, sums)
    flat_a, flat_b = of_b == (0, 0, 0), of_a == (0, 0, 0)
    if parted(of_a) or parted(of_b) or (flat_a and flat_b):
        return False
    if flat_a or flat_b:
        i, j, triangle = segment(of_a, of_b)
        if not line_meets(points, i, j, triangle, sums):
            return False
        _through(scaled, i, j, triangle, ends[0])
        ends[1] = ends[0]
        return True
    p, q, r, u, v, w = ordered(of_a, of_b)
    if orient3d(points, p, q, u, v, sums) > 0 or orient3d(points, p, r, w, u, sums) > 0:
        return False
    # the later of both starts, and the earlier of both ends
    if orient3d(points, p, q, u, w, sums) > 0:
        _through(scaled, p, q, 3, ends[0])
    else:
        _through(scaled, u, w, 0, ends[0])
    if orient3d(points, p, r, u, v, sums) < 0:
        _through(scaled, p, r, 3, ends[1])
    else:
        _through(scaled, u, v, 0, ends[1])
    return True


@numba.njit(cache=True, error_model="numpy")
def _through(points, i, j, triangle, point):
    """Write where the edge from i to j, which ends on both sides of a triangle's plane, passes through it."""
    plane = normal(points, triangle)
    low, high = height(points, triangle, plane, points[i]), height(points, triangle, plane, points[j])
    # rounding may have made both heights one, or of one sign
    part = min(max(low / (low - high), 0.0), 1.0) if low != high else 0.5
    # from the nearer end, so that no point is beyond one
    if part > 0.5:
        i, j, part = j, i, 1.0 - part
    for axis in range(3):
        point[axis] = points[i, axis] + part * (points[j, axis] - points[i, axis])


@numba.njit(cache=True)
def normal(points, first):
    """The normal of the triangle that starts at ``first``, as a tuple, twice its area long."""
    a, b, c = points[first], points[first + 1], points[first + 2]
    ux, uy, uz, vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@numba.njit(cache=True)
def height(points, first, along, point):
    """How far ``point`` is from the point ``first`` along a direction, times the direction's length."""
    x, y, z = point[0] - points[first, 0], point[1] - points[first, 1], point[2] - points[first, 2]
    return x * along[0] + y * along[1] + z * along[2]
