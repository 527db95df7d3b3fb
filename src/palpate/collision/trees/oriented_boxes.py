"""OBBs of a tree: axes that turn with the triangles, so that refitting need not find them anew."""

import numba
import numpy as np

from palpate.collision.trees.build_tree import FIRST, LAST
from palpate.collision.trees.fit_volumes import fit_along, fit_obb


@numba.njit(cache=True)
def refit_obbs(nodes, corners, each, pad, frames, axes, boxes):
    """OBBs whose axes turn with three corners of each node, around all its corners: O(m) a level.

    So a rigid motion keeps them as tight as when they were chosen, and no motion makes them unsound.
    """
    turned, frame = np.empty((3, 3)), np.empty((3, 3))
    for n in range(len(nodes)):
        first, last = each * nodes[n, FIRST], each * nodes[n, LAST]
        _frame(corners, first, each, frames[n, 0], frames[n, 1], frame)
        for i in range(3):
            for j in range(3):
                turned[i, j] = axes[n, i, 0] * frame[0, j] + axes[n, i, 1] * frame[1, j] + axes[n, i, 2] * frame[2, j]
        fit_along(corners, first, last, turned, boxes, n)
        for k in range(12, 15):
            boxes[n, k] += pad


@numba.njit(cache=True)
def choose_axes(nodes, corners, frames, axes):
    """Axes of each node's OBB at ``corners`` (3m, 3), as coordinates (3, 3) in a frame that three corners carry.

    The three, (2,) from the node's first, are the farthest from the first corner, and from the line through both.
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
def _frame(corners, first, each, second, third, frame):
    """An orthonormal frame, a row an axis: along one edge, then the other; any that fits where they vanish."""
    for k in range(2):
        # of triangle t, corners each * t … each * t + 2 are at ``points``
        corner = second if k == 0 else third
        p = first + corner // 3 * each + corner % 3
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
    """Make the second axis orthogonal to the first, and so twice: once leaves rounding; False if it lies along it."""
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
    """Scale a row to unit length; False where it has none that can be told."""
    scale = max(abs(frame[k, 0]), abs(frame[k, 1]), abs(frame[k, 2]))
    if not (scale > 0.0 and scale < np.inf and 1.0 / scale < np.inf):
        return False
    x, y, z = frame[k, 0] / scale, frame[k, 1] / scale, frame[k, 2] / scale
    length = np.sqrt(x * x + y * y + z * z)
    frame[k, 0], frame[k, 1], frame[k, 2] = x / length, y / length, z / length
    return True
