"""OBBs of a tree whose axes rotate with the triangles, so that a refit need not recompute them."""

import numba
import numpy as np

from palpate.collision.trees.build_tree import FIRST, LAST
from palpate.collision.trees.fit_volumes import fit_along, fit_obb


@numba.njit(cache=True)
def refit_obbs(nodes, corners, per_triangle, pad, frames, axes, boxes):
    """Refit OBBs with axes that rotate with three corners of each node, around all its corners: O(m) per level.

    So a rigid motion keeps them as tight as when they were chosen, and no motion makes them miss a corner.
    """
    turned, frame = np.empty((3, 3)), np.empty((3, 3))
    for n in range(len(nodes)):
        first, last = per_triangle * nodes[n, FIRST], per_triangle * nodes[n, LAST]
        _frame(corners, first, per_triangle, frames[n, 0], frames[n, 1], frame)
        for i in range(3):
            for j in range(3):
                turned[i, j] = axes[n, i, 0] * frame[0, j] + axes[n, i, 1] * frame[1, j] + axes[n, i, 2] * frame[2, j]
        fit_along(corners, first, last, turned, boxes, n)
        for k in range(12, 15):
            boxes[n, k] += pad


@numba.njit(cache=True)
def choose_axes(nodes, corners, frames, axes):
    """Choose axes of each node's OBB at ``corners`` (3m, 3), as coordinates (3, 3) in a frame of three of its corners.

    The second and third corner, (2,) counted from the node's first, are the farthest from the first, and from the line
    through both.
    """
    row, frame = np.empty((1, 15)), np.empty((3, 3))
    for n in range(len(nodes)):
        first, last = 3 * nodes[n, FIRST], 3 * nodes[n, LAST]
        frames[n, 0] = frames[n, 1] = 0
        best = 0.0
        for p in range(first + 1, last):
            far = 0.0
            for i in range(3):
                far += abs(corners[p, i] - corners[first, i])
            if far > best:
                best, frames[n, 0] = far, p - first
        _frame(corners, first, 3, frames[n, 0], 0, frame)
        best = 0.0
        for p in range(first + 1, last):
            far = 0.0
            for k in range(1, 3):
                along = 0.0
                for i in range(3):
                    along += frame[k, i] * (corners[p, i] - corners[first, i])
                far += abs(along)
            if far > best:
                best, frames[n, 1] = far, p - first
        _frame(corners, first, 3, frames[n, 0], frames[n, 1], frame)
        fit_obb(corners, first, last, row, 0)
        for i in range(3):
            for k in range(3):
                axes[n, i, k] = 0.0
                for j in range(3):
                    axes[n, i, k] += row[0, 3 + 3 * i + j] * frame[k, j]


@numba.njit(cache=True)
def _frame(corners, first, per_triangle, second, third, frame):
    """Build an orthonormal frame, one axis per row: along one edge, then the other; any that fits where they vanish."""
    for k in range(2):
        # of triangle t, corners per_triangle * t … per_triangle * t + 2 are at ``points``
        corner = second if k == 0 else third
        p = first + corner // 3 * per_triangle + corner % 3
        for i in range(3):
            frame[k, i] = corners[p, i] - corners[first, i]
    if not _normalise(frame, 0):
        frame[0, 0], frame[0, 1], frame[0, 2] = 1.0, 0.0, 0.0
    if not _normalise(frame, 1) or not _straighten(frame):
        least = 0
        for i in range(1, 3):
            if abs(frame[0, i]) < abs(frame[0, least]):
                least = i
        for i in range(3):
            frame[1, i] = 1.0 if i == least else 0.0
        _straighten(frame)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[2, i] = frame[0, j] * frame[1, k] - frame[0, k] * frame[1, j]


@numba.njit(cache=True)
def _straighten(frame):
    """Orthogonalise the second axis to the first, twice because of rounding; return False if it is parallel."""
    for _ in range(2):
        along, square = 0.0, 0.0
        for i in range(3):
            along += frame[0, i] * frame[1, i]
        for i in range(3):
            frame[1, i] -= along * frame[0, i]
            square += frame[1, i] ** 2
        if not square > 1e-12:
            return False
        _normalise(frame, 1)
    return True


@numba.njit(cache=True, error_model="numpy")
def _normalise(frame, k):
    """Scale a row to unit length; return False if it has no reliable length."""
    scale = max(abs(frame[k, 0]), abs(frame[k, 1]), abs(frame[k, 2]))
    if not (scale > 0.0 and scale < np.inf and 1.0 / scale < np.inf):
        return False
    x, y, z = frame[k, 0] / scale, frame[k, 1] / scale, frame[k, 2] / scale
    length = np.sqrt(x * x + y * y + z * z)
    frame[k, 0], frame[k, 1], frame[k, 2] = x / length, y / length, z / length
    return True
