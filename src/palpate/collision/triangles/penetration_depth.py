"""How deep two triangles are in each other, and which way leads out."""

import math

import numba
import numpy as np

from palpate.collision.triangles.crossing_segments import height, normal
from palpate.collision.triangles.predicates import digits
from palpate.collision.triangles.triangle_distance import nearest
from palpate.collision.triangles.triangle_pairs import checked, normalise

ROUNDING = 1e-15
"""What counts as on the boundary, for coordinates near 1."""


def triangle_pairs_depth(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distances (n,) [m] of triangles ``a[i]`` and ``b[i]``, and unit vectors (n, 3) along which a gets away.

    a, b : (n, 3, 3) [m]
    Apart: the distance, and the direction from b to a. Meeting: minus the least move of a along a face's normal of a or
    b after which they only touch, and the direction of this move. Segments or points that meet have no face, and are 0
    deep, across both. Trap: the depth jumps where an edge stands upright on the other triangle's edge; it is the larger
    one there. Raises InputError as ``triangle_pairs_intersect`` does.
    """
    a, b = checked(a, b)
    signed, direction = np.empty(len(a)), np.empty((len(a), 3))
    _measure(a, b, signed, direction)
    return signed, direction


@numba.njit(cache=True, error_model="numpy")
def _measure(a, b, signed, direction):
    points, scaled, sums, weights, found = np.empty((6, 3)), np.empty((6, 3)), digits(), np.empty(4), np.empty((3, 3))
    # each cut may at most double the corners, and does so only by rounding
    polygons = np.empty((2, 24, 3))
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        met, distance = nearest(points, scaled, sums, weights, found)
        if distance > 0.0:
            for axis in range(3):
                direction[n, axis] = found[2, axis] / distance
        else:
            move = _least_move(scaled, polygons, direction[n])
            distance = -move if met else 0.0
        signed[n] = math.ldexp(distance, exponent)


@numba.njit(cache=True, error_model="numpy")
def _least_move(points, polygons, direction):
    """How far the triangle of the first three ``points`` has to move along a face's normal, which is written."""
    least = np.inf
    for first in (0, 3):
        nx, ny, nz = normal(points, first)
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        if length == 0.0:
            continue
        along = (nx / length, ny / length, nz / length)
        low, high = _heights_over(points, first, along, polygons)
        # over its own face a moves up past the highest of b, over b's it is itself high or low
        up, down = (high, -low) if first == 0 else (-low, high)
        if min(up, down) < least:
            least = min(up, down)
            for axis in range(3):
                direction[axis] = along[axis] if up <= down else -along[axis]
    if least < np.inf:
        return least
    _across(points, direction)
    return 0.0


@numba.njit(cache=True, error_model="numpy")
def _heights_over(points, first, along, polygons):
    """The least and greatest height over a triangle, 0 included, of that part of the other which is above or below it.

    The other triangle is cut at three planes through the edges, upright on the face.
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
                part = from_p / (from_p - from_q)
                for axis in range(3):
                    polygons[after, kept, axis] = p[axis] + part * (q[axis] - p[axis])
                kept += 1
        now, after, count = after, now, kept
    low, high = 0.0, 0.0
    for k in range(count):
        h = height(points, first, along, polygons[now, k])
        low, high = min(low, h), max(high, h)
    return low, high


@numba.njit(cache=True, error_model="numpy")
def _across(points, direction):
    """Write a unit vector across two segments, or across one if the other is a point or along it, or any for points."""
    one, other = _longest_edge(points, 0), _longest_edge(points, 3)
    if _size(one) < _size(other):
        one, other = other, one
    x, y, z = one
    across = (y * other[2] - z * other[1], z * other[0] - x * other[2], x * other[1] - y * other[0])
    # no longer than rounding makes it, for segments on one line
    if _size(across) <= ROUNDING * _size(one):
        if abs(x) <= min(abs(y), abs(z)):
            across = (0.0, z, -y)
        else:
            across = (-z, 0.0, x) if abs(y) <= abs(z) else (y, -x, 0.0)
    size = _size(across)
    if size == 0.0:
        across, size = (0.0, 0.0, 1.0), 1.0
    x, y, z = across[0] / size, across[1] / size, across[2] / size
    length = np.sqrt(x * x + y * y + z * z)
    direction[0], direction[1], direction[2] = x / length, y / length, z / length


@numba.njit(cache=True)
def _longest_edge(points, first):
    longest = (0.0, 0.0, 0.0)
    for corner in range(3):
        i, j = first + corner, first + (corner + 1) % 3
        edge = (points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2])
        if _size(edge) > _size(longest):
            longest = edge
    return longest


@numba.njit(cache=True)
def _size(vector):
    return max(abs(vector[0]), abs(vector[1]), abs(vector[2]))
