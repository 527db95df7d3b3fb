"""Fitting of bounding volumes around points, each rounded outwards: numba kernels that write one row."""

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
TINY = 1e-150
"""Added to a sphere's radius and an OBB's half lengths [m]: smaller values underflow in products."""


@numba.njit(cache=True)
def fit_sphere(points, first, last, rows, n):
    """Fit the smallest sphere about the centre in ``rows[n, :3]`` around ``points[first:last]`` (…, 3) [m]."""
    cx, cy, cz = rows[n, 0], rows[n, 1], rows[n, 2]
    square = other = 0.0
    # two maxima, as a single one would serialise the loop
    for p in range(first, last - 1, 2):
        x, y, z = points[p, 0] - cx, points[p, 1] - cy, points[p, 2] - cz
        square = max(square, x * x + y * y + z * z)
        x, y, z = points[p + 1, 0] - cx, points[p + 1, 1] - cy, points[p + 1, 2] - cz
        other = max(other, x * x + y * y + z * z)
    x, y, z = points[last - 1, 0] - cx, points[last - 1, 1] - cy, points[last - 1, 2] - cz
    square = max(square, other, x * x + y * y + z * z)
    rows[n, 3] = np.sqrt(square) * (1.0 + 4.0 * ULP) + TINY


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
    slack = OBB_SLACK * size + 4.0 * ULP * (abs(x) + abs(y) + abs(z)) + TINY
    for k in range(12, 15):
        rows[n, k] += slack


@numba.njit(cache=True)
def _area(rows, n):
    a, b, c = rows[n, 12], rows[n, 13], rows[n, 14]
    return a * b + b * c + c * a


@numba.njit(cache=True, error_model="numpy")
def _principal(points, first, last, axes):
    """Find the eigenvectors of the points' covariance by Jacobi rotations; unchanged if it is not finite."""
    c, mean, at, scale = np.zeros((3, 3)), np.zeros(3), np.empty(3), 0.0
    for p in range(first, last):
        for i in range(3):
            mean[i] += (points[p, i] - points[first, i]) / (last - first)
            scale = max(scale, abs(points[p, i] - points[first, i]))
    if not (scale > 0.0 and 1.0 / scale < np.inf and scale < np.inf):
        return
    for p in range(first, last):
        for i in range(3):
            at[i] = (points[p, i] - points[first, i] - mean[i]) / scale
        for i in range(3):
            for j in range(3):
                c[i, j] += at[i] * at[j]
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
