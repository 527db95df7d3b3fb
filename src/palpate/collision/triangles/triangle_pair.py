"""Intersection of two triangles, decided by exact signs only.

Both are closed, so that touching counts, and either may be degenerate: then it is a segment or a point. Six points
make a pair: (6, 3), the first three of triangle a, the others of b.
"""

import numba

from palpate.collision.triangles.predicates import coincide, orient2d, orient3d


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
    of_a = plane_sides(points, 0, 3, sums)
    if one_sided(of_a):
        return False
    of_b = plane_sides(points, 3, 0, sums)
    if one_sided(of_b):
        return False
    if of_a != (0, 0, 0) and of_b != (0, 0, 0):
        p, q, r, u, v, w = canonical_order(of_a, of_b)
        return orient3d(points, p, q, u, v, sums) <= 0 and orient3d(points, p, r, w, u, sums) <= 0
    if of_a != (0, 0, 0) or of_b != (0, 0, 0):
        i, j, triangle = degenerate_segment(of_a, of_b)
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

    It is the upper side: where it is not, the other triangle is reversed. So along the planes' common line
    edge pq comes before pr, and uw before uv.
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
    """Choose two points of the degenerate triangle, not both in the other's plane nor on one side of it.

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
    """Find an axis along which some triple of points is seen as a triangle; -1 if there is none."""
    for axis in range(3):
        for i, j, k in triples:
            if orient2d(points, i, j, k, axis, sums) != 0:
                return axis
    return -1


@numba.njit(cache=True)
def _intersect_projected(points, axis, sums):
    """Test whether no edge's line separates the triangles projected along ``axis``, not all on one line there."""
    for i in range(6):
        one = i - i % 3
        j, k, other = one + (i + 1) % 3, one + (i + 2) % 3, 3 - one
        side = orient2d(points, i, j, other, axis, sums)
        apart = side != 0
        for point in (other + 1, other + 2):
            apart = apart and orient2d(points, i, j, point, axis, sums) == side
        if apart and orient2d(points, i, j, k, axis, sums) != side:
            return False
    return True
