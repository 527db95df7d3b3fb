"""Distance of two triangles, their penetration depth, and the direction of separation."""

import math

import numba
import numpy as np

from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, closest, separation
from palpate.collision.triangles.intersection import (
    check_pairs,
    find_crossing,
    height,
    normal,
    normalise,
    triangles_intersect,
)
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
    signed, _, places = triangle_pairs_contact(a, b)
    return np.where(signed > 0.0, signed, 0.0), places[:, 0], places[:, 1]


@numba.njit(cache=True)
def pair_distance(points, scaled, sums, weights, found):
    """Test whether a pair ``points`` (6, 3) intersects, and compute the distance of ``scaled``, from ``normalise``.

    found : (3, 3), overwritten: the closest points on a and on b, and the vector from b to a
    weights : (4,), overwritten
    """
    intersecting = triangles_intersect(points, sums)
    if intersecting and find_crossing(points, scaled, sums, found):
        for axis in range(3):
            found[:2, axis] = 0.5 * (found[0, axis] + found[1, axis])
        found[2] = 0.0
        return True, 0.0
    least = np.inf
    for n in range(len(STENCILS)):
        distance, _ = closest(POINT_TRIANGLE if n < 6 else EDGE_EDGE, scaled, STENCILS[n], weights)
        if distance < least:
            least = distance
            _write(scaled, STENCILS[n], weights, found)
    if intersecting:
        found[1], found[2], least = found[0], 0.0, 0.0
    return intersecting, least


@numba.njit(cache=True)
def _write(points, nodes, weights, found):
    """Write the closest points of a stencil on a and on b, and the vector from b to a, into ``found`` (3, 3)."""
    found[:] = 0.0
    # the first part of a stencil has the positive weights, and may belong to b
    sign = 1.0 if nodes[0] < 3 else -1.0
    between = separation(points, nodes, weights)
    for axis in range(3):
        found[2, axis] = sign * between[axis]
        for i in range(4):
            if nodes[i] < 3:
                found[0, axis] += sign * weights[i] * points[nodes[i], axis]
            else:
                found[1, axis] -= sign * weights[i] * points[nodes[i], axis]


ROUNDING = 1e-15
"""Tolerance within which a point counts as on the boundary, for coordinates near 1."""


def triangle_pairs_contact(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute signed distances (n,) [m] of triangles ``a[i]`` and ``b[i]``, and unit vectors (n, 3) that separate them.

    a, b : (n, 3, 3) [m]
    Also returns the closest places (n, 2, 3) [m] on a and on b, as ``triangle_pairs_distance`` does.
    Disjoint: the distance, and the direction from b to a. Intersecting: minus the least translation of a along a face
    normal of a or b after which they only touch, and its direction. Intersecting segments or points have no face: their
    depth is 0, in a direction perpendicular to both. Trap: the depth jumps where an edge is perpendicular to the other
    triangle at one of its edges; it is the larger one there. Raises InputError as ``triangle_pairs_intersect`` does.
    """
    return _measure_depth(*check_pairs(a, b))


@numba.njit(cache=True, error_model="numpy")
def _measure_depth(a, b):
    signed, direction, places = np.empty(len(a)), np.empty((len(a), 3)), np.empty((len(a), 2, 3))
    points, scaled, sums = np.empty((6, 3)), np.empty((6, 3)), new_accumulator()
    weights, found = np.empty(4), np.empty((3, 3))
    # each cut may at most double the corners, and does so only by rounding
    polygons = np.empty((2, 24, 3))
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        intersecting, distance = pair_distance(points, scaled, sums, weights, found)
        if distance > 0.0:
            for axis in range(3):
                direction[n, axis] = found[2, axis] / distance
        else:
            translation = _least_translation(scaled, polygons, direction[n])
            distance = -translation if intersecting else 0.0
        signed[n] = math.ldexp(distance, exponent)
        for side in range(2):
            for axis in range(3):
                places[n, side, axis] = math.ldexp(found[side, axis], exponent)
    return signed, direction, places


@numba.njit(cache=True, error_model="numpy")
def _least_translation(points, polygons, direction):
    """Return the least translation of a along a face normal after which a and b only touch, and write its direction."""
    least = np.inf
    for first in (0, 3):
        nx, ny, nz = normal(points, first)
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length == 0.0:
            continue
        along = (nx / length, ny / length, nz / length)
        low, high = _heights_over(points, first, along, polygons)
        # over a's own face, a moves up past the highest point of b; over b's face, a is the one above or below
        up, down = (high, -low) if first == 0 else (-low, high)
        if min(up, down) < least:
            least = min(up, down)
            for axis in range(3):
                direction[axis] = along[axis] if up <= down else -along[axis]
    if least < np.inf:
        return least
    _write_perpendicular(points, direction)
    return 0.0


@numba.njit(cache=True, error_model="numpy")
def _heights_over(points, first, along, polygons):
    """Find the least and greatest height over a triangle, 0 included, of the part of the other above or below it.

    The other triangle is clipped by three planes through the edges, perpendicular to the face.
    """
    now, after, count = 0, 1, 3
    polygons[now, :3] = points[3 - first : 6 - first]
    for corner in range(3):
        i, j = first + corner, first + (corner + 1) % 3
        ex, ey, ez = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        edge = np.sqrt(ex * ex + ey * ey + ez * ez)
        inward = (
            (along[1] * ez - along[2] * ey) / edge,
            (along[2] * ex - along[0] * ez) / edge,
            (along[0] * ey - along[1] * ex) / edge,
        )
        kept = 0
        for k in range(count):
            p, q = polygons[now, k], polygons[now, (k + 1) % count]
            from_p, from_q = height(points, i, inward, p), height(points, i, inward, q)
            if from_p >= -ROUNDING:
                polygons[after, kept] = p
                kept += 1
            if min(from_p, from_q) < -ROUNDING and max(from_p, from_q) > ROUNDING:
                fraction = from_p / (from_p - from_q)
                for axis in range(3):
                    polygons[after, kept, axis] = p[axis] + fraction * (q[axis] - p[axis])
                kept += 1
        now, after, count = after, now, kept
    low, high = 0.0, 0.0
    for k in range(count):
        h = height(points, first, along, polygons[now, k])
        low, high = min(low, h), max(high, h)
    return low, high


@numba.njit(cache=True, error_model="numpy")
def _write_perpendicular(points, direction):
    """Write a unit vector perpendicular to two degenerate triangles: to both segments, to the one there is, or any."""
    one, other = _longest_edge(points, 0), _longest_edge(points, 3)
    if _largest_component(one) < _largest_component(other):
        one, other = other, one
    x, y, z = one
    perpendicular = (y * other[2] - z * other[1], z * other[0] - x * other[2], x * other[1] - y * other[0])
    # for segments on one line only rounding is left
    if _largest_component(perpendicular) <= ROUNDING * _largest_component(one):
        if abs(x) <= min(abs(y), abs(z)):
            perpendicular = (0.0, z, -y)
        else:
            perpendicular = (-z, 0.0, x) if abs(y) <= abs(z) else (y, -x, 0.0)
    size = _largest_component(perpendicular)
    if size == 0.0:
        perpendicular, size = (0.0, 0.0, 1.0), 1.0
    x, y, z = perpendicular[0] / size, perpendicular[1] / size, perpendicular[2] / size
    length = np.sqrt(x * x + y * y + z * z)
    direction[0], direction[1], direction[2] = x / length, y / length, z / length


@numba.njit(cache=True)
def _longest_edge(points, first):
    longest = (0.0, 0.0, 0.0)
    for corner in range(3):
        i, j = first + corner, first + (corner + 1) % 3
        edge = (points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2])
        if _largest_component(edge) > _largest_component(longest):
            longest = edge
    return longest


@numba.njit(cache=True)
def _largest_component(vector):
    return max(abs(vector[0]), abs(vector[1]), abs(vector[2]))
