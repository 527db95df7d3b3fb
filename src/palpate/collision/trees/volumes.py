"""Bounding volumes: sphere, AABB, OBB, 14-DOP and 18-DOP, one row of numbers each.

They are fitted around points and rounded outwards; their overlap is the inner loop of a search.
"""

import numba
import numpy as np

_AXES = np.eye(3)
_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]])
_EDGES = np.array([[1.0, 1, 0], [1, 0, 1], [0, 1, 1], [1, -1, 0], [1, 0, -1], [0, 1, -1]])
DIRECTIONS = {"aabb": _AXES, "dop14": np.vstack([_AXES, _CORNERS]), "dop18": np.vstack([_AXES, _EDGES])}
"""Normals of the slabs, (3 + k, 3); those after the first three are not of unit length, so that sums suffice."""
ULP = 2.0**-52
OBB_SLACK = 1e-13
"""Added to an OBB's half lengths, relative to their sum: its axes and its points' projections are rounded."""
UNDERFLOW_M = 1e-150
"""Added to a sphere's radius and an OBB's half lengths [m]: smaller values underflow in products."""


@numba.njit(cache=True)
def fit_sphere(points, first, last, rows, n):
    """Fit the smallest sphere about the centre in ``rows[n, :3]`` around ``points[first:last]`` (…, 3) [m]."""
    cx, cy, cz = rows[n, 0], rows[n, 1], rows[n, 2]
    square = odd = 0.0
    # two maxima, as a single one would serialise the loop
    for p in range(first, last - 1, 2):
        x, y, z = points[p, 0] - cx, points[p, 1] - cy, points[p, 2] - cz
        square = max(square, x * x + y * y + z * z)
        x, y, z = points[p + 1, 0] - cx, points[p + 1, 1] - cy, points[p + 1, 2] - cz
        odd = max(odd, x * x + y * y + z * z)
    x, y, z = points[last - 1, 0] - cx, points[last - 1, 1] - cy, points[last - 1, 2] - cz
    square = max(square, odd, x * x + y * y + z * z)
    rows[n, 3] = np.sqrt(square) * (1.0 + 4.0 * ULP) + UNDERFLOW_M


@numba.njit(cache=True)
def fit_box(points, first, last, rows, n):
    """Fit the smallest AABB, exactly."""
    for i in range(3):
        low = high = points[first, i]
        for p in range(first + 1, last):
            low, high = min(low, points[p, i]), max(high, points[p, i])
        rows[n, i], rows[n, 3 + i] = low, high


@numba.njit(cache=True)
def fit_dop(points, first, last, directions, rows, n):
    """Fit the smallest k-DOP with the slabs ``directions``; sums of coordinates are rounded, hence the slack."""
    half = len(directions)
    for k in range(half):
        u, v, w = directions[k, 0], directions[k, 1], directions[k, 2]
        low, high = np.inf, -np.inf
        for p in range(first, last):
            x, y, z = u * points[p, 0], v * points[p, 1], w * points[p, 2]
            slack = 2.0 * ULP * (abs(x) + abs(y) + abs(z)) if k > 2 else 0.0
            low, high = min(low, x + y + z - slack), max(high, x + y + z + slack)
        rows[n, k], rows[n, half + k] = low, high


@numba.njit(cache=True)
def merge_bounds(half, rows, n, child):
    """Merge ``half`` low and ``half`` high bounds of the children ``child`` and the next into those of a node."""
    for k in range(half):
        rows[n, k] = min(rows[child, k], rows[child + 1, k])
        rows[n, half + k] = max(rows[child, half + k], rows[child + 1, half + k])


@numba.njit(cache=True)
def fit_obb(points, first, last, rows, n):
    """Fit the smaller of two boxes: along the axes of the points' covariance, or along x, y and z."""
    axes, other = np.eye(3), np.empty((1, 15))
    fit_along(points, first, last, axes, other, 0)
    _principal(points, first, last, axes)
    fit_along(points, first, last, axes, rows, n)
    # flat boxes have no volume to compare
    if not _area(rows, n) < _area(other, 0):
        rows[n] = other[0]


@numba.njit(cache=True)
def fit_along(points, first, last, axes, rows, n):
    """Fit the smallest box with the given ``axes`` (3, 3), one per row, orthonormal to within rounding."""
    x0, y0, z0 = points[first, 0], points[first, 1], points[first, 2]
    x, y, z, size = x0, y0, z0, 0.0
    for k in range(3):
        u, v, w = axes[k, 0], axes[k, 1], axes[k, 2]
        low = high = 0.0
        for p in range(first + 1, last):
            s = u * (points[p, 0] - x0) + v * (points[p, 1] - y0) + w * (points[p, 2] - z0)
            low, high = min(low, s), max(high, s)
        middle = 0.5 * (low + high)
        x, y, z, size = x + middle * u, y + middle * v, z + middle * w, size + 0.5 * (high - low)
        rows[n, 3 + 3 * k], rows[n, 4 + 3 * k], rows[n, 5 + 3 * k], rows[n, 12 + k] = u, v, w, 0.5 * (high - low)
    rows[n, 0], rows[n, 1], rows[n, 2] = x, y, z
    # the middle itself is rounded, to the last digit of the coordinates
    slack = OBB_SLACK * size + 4.0 * ULP * (abs(x) + abs(y) + abs(z)) + UNDERFLOW_M
    for k in range(12, 15):
        rows[n, k] += slack


@numba.njit(cache=True)
def _area(rows, n):
    a, b, c = rows[n, 12], rows[n, 13], rows[n, 14]
    return a * b + b * c + c * a


@numba.njit(cache=True, error_model="numpy")
def _principal(points, first, last, axes):
    """Find the eigenvectors of the points' covariance by Jacobi rotations; unchanged if it is not finite."""
    c, mean, offset, scale = np.zeros((3, 3)), np.zeros(3), np.empty(3), 0.0
    for p in range(first, last):
        for i in range(3):
            mean[i] += (points[p, i] - points[first, i]) / (last - first)
            scale = max(scale, abs(points[p, i] - points[first, i]))
    if not (scale > 0.0 and 1.0 / scale < np.inf and scale < np.inf):
        return
    for p in range(first, last):
        for i in range(3):
            offset[i] = (points[p, i] - points[first, i] - mean[i]) / scale
        for i in range(3):
            for j in range(3):
                c[i, j] += offset[i] * offset[j]
    for turn in range(15):
        # each rotation moves the larger eigenvalue to the front, so the pairs must agree on an order
        i, j = (turn % 3) // 2, min(turn % 3 + 1, 2)
        if c[i, j] == 0.0:
            continue
        angle = 0.5 * np.arctan2(2.0 * c[i, j], c[i, i] - c[j, j])
        cosine, sine = np.cos(angle), np.sin(angle)
        for k in range(3):
            c[i, k], c[j, k] = cosine * c[i, k] + sine * c[j, k], cosine * c[j, k] - sine * c[i, k]
            axes[i, k], axes[j, k] = cosine * axes[i, k] + sine * axes[j, k], cosine * axes[j, k] - sine * axes[i, k]
        for k in range(3):
            c[k, i], c[k, j] = cosine * c[k, i] + sine * c[k, j], cosine * c[k, j] - sine * c[k, i]


SPHERE, BOTH, AABB, OBB, DOP14, DOP18 = range(6)
"""Kinds of a node's volume; BOTH, a sphere and an AABB, is a composite tree's middle layer."""
PARALLEL = 1e-12
"""Slack in the OBB's separating axes, relative to its half lengths: the cross product of parallel axes is noise."""


@numba.njit(cache=True, forceinline=True)
def volumes_overlap(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, a, b):
    """Test whether nodes ``a`` and ``b`` of two trees overlap, by the rule of paper 3, chapter 4.

    Sphere–sphere if both have spheres, AABB–AABB if both have boxes, else sphere–AABB; other kinds only with their own.
    Trap: numba counts references to arrays at every call and view; one here makes a search ten times as long.
    """
    if kind_a <= BOTH and kind_b <= BOTH:
        x, y = spheres_a[a, 0] - spheres_b[b, 0], spheres_a[a, 1] - spheres_b[b, 1]
        z, reach = spheres_a[a, 2] - spheres_b[b, 2], spheres_a[a, 3] + spheres_b[b, 3]
        return not x * x + y * y + z * z > reach * reach
    if kind_a <= AABB and kind_a != SPHERE and kind_b != SPHERE:
        if boxes_a[a, 0] > boxes_b[b, 3] or boxes_b[b, 0] > boxes_a[a, 3]:
            return False
        if boxes_a[a, 1] > boxes_b[b, 4] or boxes_b[b, 1] > boxes_a[a, 4]:
            return False
        return not (boxes_a[a, 2] > boxes_b[b, 5] or boxes_b[b, 2] > boxes_a[a, 5])
    if kind_a == SPHERE:
        return _sphere_overlaps_box(
            _triple(spheres_a, a, 0), spheres_a[a, 3], _triple(boxes_b, b, 0), _triple(boxes_b, b, 3)
        )
    if kind_b == SPHERE:
        return _sphere_overlaps_box(
            _triple(spheres_b, b, 0), spheres_b[b, 3], _triple(boxes_a, a, 0), _triple(boxes_a, a, 3)
        )
    if kind_a == OBB:
        return _obbs_overlap(
            (boxes_a[a, 0] - boxes_b[b, 0], boxes_a[a, 1] - boxes_b[b, 1], boxes_a[a, 2] - boxes_b[b, 2]),
            (_triple(boxes_a, a, 3), _triple(boxes_a, a, 6), _triple(boxes_a, a, 9)),
            (_triple(boxes_b, b, 3), _triple(boxes_b, b, 6), _triple(boxes_b, b, 9)),
            _triple(boxes_a, a, 12),
            _triple(boxes_b, b, 12),
        )
    half = boxes_a.shape[1] // 2
    for k in range(half):  # noqa: SIM110
        if boxes_a[a, k] > boxes_b[b, half + k] or boxes_b[b, k] > boxes_a[a, half + k]:
            return False
    return True


@numba.njit(cache=True, forceinline=True)
def _triple(rows, n, k):
    return rows[n, k], rows[n, k + 1], rows[n, k + 2]


@numba.njit(cache=True)
def _sphere_overlaps_box(centre, radius, low, high):
    """Test whether the nearest point of a box is within the radius (Arvo 1990)."""
    x = max(low[0] - centre[0], centre[0] - high[0], 0.0)
    y = max(low[1] - centre[1], centre[1] - high[1], 0.0)
    z = max(low[2] - centre[2], centre[2] - high[2], 0.0)
    return not x * x + y * y + z * z > radius * radius


@numba.njit(cache=True)
def _obbs_overlap(offset, u, v, a, b):
    """Test 15 axes (Gottschalk, Lin, Manocha 1996) of boxes of axes u, v, half lengths a, b; r = u vᵀ, t = u offset."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = _products(u[0], v), _products(u[1], v), _products(u[2], v)
    s00, s01, s02 = abs(r00) + PARALLEL, abs(r01) + PARALLEL, abs(r02) + PARALLEL
    s10, s11, s12 = abs(r10) + PARALLEL, abs(r11) + PARALLEL, abs(r12) + PARALLEL
    s20, s21, s22 = abs(r20) + PARALLEL, abs(r21) + PARALLEL, abs(r22) + PARALLEL
    t0, t1, t2 = _products(offset, u)
    apart = abs(t0) > a[0] + b[0] * s00 + b[1] * s01 + b[2] * s02
    apart |= abs(t1) > a[1] + b[0] * s10 + b[1] * s11 + b[2] * s12
    apart |= abs(t2) > a[2] + b[0] * s20 + b[1] * s21 + b[2] * s22
    apart |= abs(t0 * r00 + t1 * r10 + t2 * r20) > b[0] + a[0] * s00 + a[1] * s10 + a[2] * s20
    apart |= abs(t0 * r01 + t1 * r11 + t2 * r21) > b[1] + a[0] * s01 + a[1] * s11 + a[2] * s21
    apart |= abs(t0 * r02 + t1 * r12 + t2 * r22) > b[2] + a[0] * s02 + a[1] * s12 + a[2] * s22
    if apart:
        return False
    apart |= abs(t2 * r10 - t1 * r20) > a[1] * s20 + a[2] * s10 + b[1] * s02 + b[2] * s01
    apart |= abs(t2 * r11 - t1 * r21) > a[1] * s21 + a[2] * s11 + b[0] * s02 + b[2] * s00
    apart |= abs(t2 * r12 - t1 * r22) > a[1] * s22 + a[2] * s12 + b[0] * s01 + b[1] * s00
    apart |= abs(t0 * r20 - t2 * r00) > a[0] * s20 + a[2] * s00 + b[1] * s12 + b[2] * s11
    apart |= abs(t0 * r21 - t2 * r01) > a[0] * s21 + a[2] * s01 + b[0] * s12 + b[2] * s10
    apart |= abs(t0 * r22 - t2 * r02) > a[0] * s22 + a[2] * s02 + b[0] * s11 + b[1] * s10
    apart |= abs(t1 * r00 - t0 * r10) > a[0] * s10 + a[1] * s00 + b[1] * s22 + b[2] * s21
    apart |= abs(t1 * r01 - t0 * r11) > a[0] * s11 + a[1] * s01 + b[0] * s22 + b[2] * s20
    apart |= abs(t1 * r02 - t0 * r12) > a[0] * s12 + a[1] * s02 + b[0] * s21 + b[1] * s20
    return not apart


@numba.njit(cache=True)
def _products(t, u):
    return (
        t[0] * u[0][0] + t[1] * u[0][1] + t[2] * u[0][2],
        t[0] * u[1][0] + t[1] * u[1][1] + t[2] * u[1][2],
        t[0] * u[2][0] + t[1] * u[2][1] + t[2] * u[2][2],
    )


KINDS = {"sphere": SPHERE, "aabb": AABB, "obb": OBB, "dop14": DOP14, "dop18": DOP18}
"""Rows: sphere = centre, radius; AABB and k-DOPs = lower bounds along DIRECTIONS[k], then upper ones;
OBB = centre, axes (one after the other), half lengths."""
