"""Intersection of two triangles, decided by exact signs only, and the segment that they have in common.

Both are closed, so that touching counts, and either may be degenerate: then it is a segment or a point. Six points
make a pair: (6, 3), the first three of triangle a, the others of b.
"""

import math

import numba
import numpy as np
from numpy.typing import ArrayLike

from palpate.collision.triangles.predicates import coincide, new_accumulator, orient2d, orient3d
from palpate.errors import InputError


def coordinates(values: ArrayLike, shape: tuple, name: str) -> np.ndarray:
    """Return ``values`` as contiguous float64 of the ``shape``, in which None is any length.

    Raises InputError, naming ``name``, if they are not numbers or have another shape.
    """
    array = np.asarray(values)
    fits = len(array.shape) == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name} are not numbers; give coordinates in m.")
    if not fits:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{name} have shape {array.shape}; give ({wanted}) coordinates in m.")
    return np.ascontiguousarray(array, dtype=float)


@numba.njit(cache=True)
def triangles_intersect(points, sums):
    """Test whether the triangles of ``points`` (6, 3), finite, intersect; sums : from ``predicates.new_accumulator``.

    Each is tested against the other's plane. If both planes are crossed, the triangles cut the planes' common line in
    two intervals, whose order two more determinants decide: the problem is projected to that line (Möller 1997, in the
    form of Devillers and Guigue, Faster triangle-triangle intersection tests, 2002, which needs no division). Coplanar
    triangles are projected along an axis that is not parallel to their plane, and are disjoint if a line along an edge
    separates them. A segment crosses a triangle's plane in a point, or is coplanar or collinear with the other.
    """
    if not boxes_overlap(points):
        return False
    sides_a = plane_sides(points, 0, 3, sums)
    if one_sided(sides_a):
        return False
    sides_b = plane_sides(points, 3, 0, sums)
    if one_sided(sides_b):
        return False
    if sides_a != (0, 0, 0) and sides_b != (0, 0, 0):
        p, q, r, u, v, w = canonical_order(sides_a, sides_b)
        return orient3d(points, p, q, u, v, sums) <= 0 and orient3d(points, p, r, w, u, sums) <= 0
    if sides_a != (0, 0, 0) or sides_b != (0, 0, 0):
        i, j, triangle = degenerate_segment(sides_a, sides_b)
        return line_intersects(points, i, j, triangle, sums)
    return _intersect_flat(points, sums)


@numba.njit(cache=True)
def boxes_overlap(points):
    """Test whether the axis-aligned boxes of the triangles have a point in common."""
    for axis in range(3):
        a, b, c = points[0, axis], points[1, axis], points[2, axis]
        d, e, f = points[3, axis], points[4, axis], points[5, axis]
        if max(a, b, c) < min(d, e, f) or max(d, e, f) < min(a, b, c):
            return False
    return True


@numba.njit(cache=True)
def plane_sides(points, first, plane, sums):
    """Find the signs of the three points from ``first`` on, relative to the plane of the triangle from ``plane`` on."""
    signs = (0, 0, 0)
    for point in range(first, first + 3):
        signs = (signs[1], signs[2], orient3d(points, plane, plane + 1, plane + 2, point, sums))
    return signs


@numba.njit(cache=True)
def canonical_order(of_a, of_b):
    """Order the pair's points: p, q, r of a and u, v, w of b, with p and u alone on a side of the other's plane.

    of_a, of_b : ``plane_sides`` of their points. That side is the upper one, or else the other triangle is reversed; so
    along the planes' common line edge pq comes before pr, and uw before uv.
    """
    i, upper_a = _lone_vertex(of_a)
    j, upper_b = _lone_vertex(of_b)
    q, r = (i + 1) % 3, (i + 2) % 3
    v, w = 3 + (j + 1) % 3, 3 + (j + 2) % 3
    if not upper_b:
        q, r = r, q
    if not upper_a:
        v, w = w, v
    return i, q, r, 3 + j, v, w


@numba.njit(cache=True)
def one_sided(signs):
    """Test whether all three points lie strictly on one side of the plane."""
    return signs[0] != 0 and signs[0] == signs[1] and signs[1] == signs[2]


@numba.njit(cache=True)
def _lone_vertex(signs):
    """Find the vertex alone on its side, and whether that is the upper one; signs are not all equal nor all 0."""
    for i in range(3):
        s = signs[i]
        if s != 0 and signs[(i + 1) % 3] != s and signs[(i + 2) % 3] != s:
            return i, s > 0
    # the others are on one side, and this one is in the plane
    for i in range(2):
        if signs[i] == 0:
            return i, signs[2] < 0
    return 2, signs[0] < 0


@numba.njit(cache=True)
def degenerate_segment(of_a, of_b):
    """Choose two points of the degenerate triangle by ``plane_sides``, not both in the other's plane nor on one side.

    Also returns the first point of the other triangle. One of the two is degenerate, since its undefined plane contains
    all points of the other.
    """
    signs = of_b if of_a == (0, 0, 0) else of_a
    start = 3 if of_a == (0, 0, 0) else 0
    i = 0
    while signs[i] == 0:
        i += 1
    j = (i + 1) % 3
    if signs[j] == signs[i]:
        j = (i + 2) % 3
    return start + i, start + j, 3 - start


@numba.njit(cache=True)
def line_intersects(points, i, j, triangle, sums):
    """Test whether the line through i and j, not in the plane of the triangle from ``triangle`` on, intersects it."""
    low = high = 0
    for corner in range(3):
        sign = orient3d(points, i, j, triangle + corner, triangle + (corner + 1) % 3, sums)
        low, high = min(low, sign), max(high, sign)
    return low == 0 or high == 0


@numba.njit(cache=True)
def _intersect_flat(points, sums):
    """Test coplanar triangles, or two degenerate ones, for intersection; their boxes overlap."""
    axis = _projection_axis(points, ((0, 1, 2), (3, 4, 5)), sums)
    if axis < 0:
        i, j = 0, 2 if coincide(points, 0, 1) else 1
        k, l = 3, 5 if coincide(points, 3, 4) else 4  # noqa: E741
        if orient3d(points, i, j, k, l, sums) != 0:
            return False
        axis = _projection_axis(points, ((i, j, k), (i, j, l), (k, l, i), (k, l, j)), sums)
    # without an axis all points are on one line, where boxes overlap only if the segments do
    return axis < 0 or _intersect_projected(points, axis, sums)


@numba.njit(cache=True)
def _projection_axis(points, triples, sums):
    """Find an axis along which some triple of points projects to a triangle with area; -1 if there is none."""
    for axis in range(3):
        for i, j, k in triples:
            if orient2d(points, i, j, k, axis, sums) != 0:
                return axis
    return -1


@numba.njit(cache=True)
def _intersect_projected(points, axis, sums):
    """Test whether no edge's line separates the triangles projected along ``axis``, not all on one line there."""
    for i in range(6):
        triangle = i - i % 3
        j, k, opposite = triangle + (i + 1) % 3, triangle + (i + 2) % 3, 3 - triangle
        side = orient2d(points, i, j, opposite, axis, sums)
        apart = side != 0
        for point in (opposite + 1, opposite + 2):
            apart = apart and orient2d(points, i, j, point, axis, sums) == side
        if apart and orient2d(points, i, j, k, axis, sums) != side:
            return False
    return True


def triangle_pairs_intersect(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Test whether triangle ``a[i]`` and triangle ``b[i]`` have a point in common, (n,) bool, for each i.

    a, b : (n, 3, 3) [m], the corners of each triangle
    The answer is exact for the coordinates as given, and the same in every order of corners and of arguments. Triangles
    are closed: touching at a vertex, an edge or a face, and lying in one plane with a common point, count as
    intersecting; a degenerate one is a segment or a point. Method: paper 3, chapter 4, "by projection to a lower
    dimension"; see ``triangles_intersect``. Raises InputError for wrong shapes and for coordinates that are not finite.
    """
    a, b = check_pairs(a, b)
    triangles = np.arange(3 * len(a)).reshape(-1, 3)
    pairs = np.repeat(np.arange(len(a)), 2).reshape(-1, 2)
    return pairs_intersect(a.reshape(-1, 3), triangles, b.reshape(-1, 3), triangles, pairs)


@numba.njit(cache=True)
def pairs_intersect(points_a, triangles_a, points_b, triangles_b, pairs):
    """Test whether the triangles of each pair have a point in common, (k,) bool, as ``triangle_pairs_intersect`` does.

    points : (n, 3) [m]; triangles : (m, 3); pairs : (k, 2), a triangle of a and one of b
    Trap: nothing is checked; points must be finite, and indices in range.
    """
    crossing = np.empty(len(pairs), dtype=np.bool_)
    points, sums = np.empty((6, 3)), new_accumulator()
    for n in range(len(pairs)):
        copy_corners(points_a, triangles_a, pairs[n, 0], points, 0)
        copy_corners(points_b, triangles_b, pairs[n, 1], points, 3)
        crossing[n] = triangles_intersect(points, sums)
    return crossing


@numba.njit(cache=True)
def copy_corners(points, triangles, n, pair, first):
    """Copy the corners of triangle ``n`` to ``pair`` (6, 3), from row ``first`` on."""
    for corner in range(3):
        node = triangles[n, corner]
        for axis in range(3):
            pair[first + corner, axis] = points[node, axis]


@numba.njit(cache=True)
def normalise(pair, scaled):
    """Write the pair (6, 3), over a power of two that makes its largest near 1, to ``scaled``; return the exponent.

    So squares and products do not overflow. Trap: coordinates below 1e-308 of the largest lose bits.
    """
    exponent = math.frexp(np.abs(pair).max())[1]
    for corner in range(6):
        for axis in range(3):
            scaled[corner, axis] = math.ldexp(pair[corner, axis], -exponent)
    return exponent


def check_pairs(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return both as contiguous float64 (n, 3, 3); raise InputError if they are not pairs of finite triangles."""
    a, b = (coordinates(corners, (None, 3, 3), f"Triangles {name}") for name, corners in (("a", a), ("b", b)))
    if len(a) != len(b):
        raise InputError(f"Triangles a {a.shape} and b {b.shape} are not pairs; give two arrays of shape (n, 3, 3).")
    for name, corners in (("a", a), ("b", b)):
        finite = np.isfinite(corners).all(axis=(1, 2))
        if not finite.all():
            raise InputError(
                f"Triangle {np.argmin(finite)} of {name} has a coordinate that is not finite; remove or repair it."
            )
    return a, b


def crossing_segments(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find which triangles ``a[i]`` and ``b[i]`` cross, (n,) bool, and the ends (n, 2, 3) [m] of their common segment.

    a, b : (n, 3, 3) [m]
    The test, and the edges on which the ends lie, are exact; positions along these edges are rounded. Triangles in
    different planes that only touch count, with both ends in one place if they touch in a point, and so does a segment
    (a degenerate triangle) through a triangle. Coplanar triangles and two segments do not count: their ends are zero.
    Traps: the ends are ill-conditioned where the planes are nearly parallel, and they ignore coordinates below 1e-308
    of a pair's largest. Raises InputError as ``triangle_pairs_intersect`` does.
    """
    return _find_crossings(*check_pairs(a, b))


@numba.njit(cache=True)
def _find_crossings(a, b):
    """Return which pairs cross, and the ends of their segments, as ``crossing_segments`` says."""
    crossing, ends = np.zeros(len(a), dtype=np.bool_), np.zeros((len(a), 2, 3))
    points, scaled, sums = np.empty((6, 3)), np.empty((6, 3)), new_accumulator()
    for n in range(len(a)):
        points[:3], points[3:] = a[n], b[n]
        exponent = normalise(points, scaled)
        crossing[n] = find_crossing(points, scaled, sums, ends[n])
        for end in range(2):
            for axis in range(3):
                ends[n, end, axis] = math.ldexp(ends[n, end, axis], exponent)
    return crossing, ends


@numba.njit(cache=True)
def find_crossing(points, scaled, sums, ends):
    """Test whether a pair ``points`` (6, 3) crosses, as in ``crossing_segments``; if so, write ``ends`` (2, 3).

    The ends are those of ``scaled``, from ``normalise``.
    """
    if not boxes_overlap(points):
        return False
    sides_a, sides_b = plane_sides(points, 0, 3, sums), plane_sides(points, 3, 0, sums)
    flat_a, flat_b = sides_b == (0, 0, 0), sides_a == (0, 0, 0)
    if one_sided(sides_a) or one_sided(sides_b) or (flat_a and flat_b):
        return False
    if flat_a or flat_b:
        i, j, triangle = degenerate_segment(sides_a, sides_b)
        if not line_intersects(points, i, j, triangle, sums):
            return False
        _intersect_plane(scaled, i, j, triangle, ends[0])
        ends[1] = ends[0]
        return True
    p, q, r, u, v, w = canonical_order(sides_a, sides_b)
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
    height_i, height_j = height(points, triangle, plane, points[i]), height(points, triangle, plane, points[j])
    # rounding may have made both heights equal, or of equal sign
    fraction = min(max(height_i / (height_i - height_j), 0.0), 1.0) if height_i != height_j else 0.5
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
