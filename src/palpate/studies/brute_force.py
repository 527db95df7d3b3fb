"""Crossing triangles without any tree: sorted boxes, then the exact test on each pair of boxes that overlaps."""

import numba
import numpy as np

from palpate.collision.triangles.intersection import pairs_intersect


def crossing(points: list[np.ndarray], triangles: list[np.ndarray]) -> np.ndarray:
    """Find the crossing triangles of two bodies, or of one with itself, as sorted pairs (k, 2) int64.

    points : (n, 3) [m], triangles : (m, 3) int64, one or two of each
    Pairs of one body have i < j, and triangles that share a node are left out. Triangles are closed, as in
    ``triangle_pairs_intersect``.
    """
    pairs = overlapping(points, triangles)
    if len(triangles) == 1:
        nodes_1, nodes_2 = triangles[0][pairs[:, 0]], triangles[0][pairs[:, 1]]
        pairs = pairs[~(nodes_1[:, :, None] == nodes_2[:, None, :]).any(axis=(1, 2))]
    body_1, body_2 = (points[0], triangles[0]), (points[-1], triangles[-1])
    return pairs[pairs_intersect(*body_1, *body_2, np.ascontiguousarray(pairs))]


def overlapping(points: list[np.ndarray], triangles: list[np.ndarray]) -> np.ndarray:
    """Find the triangles whose closed boxes overlap, as sorted pairs (k, 2) int64; i < j for one body with itself."""
    corners = [positions[cells] for positions, cells in zip(points, triangles, strict=True)]
    axis = int(np.argmax(np.std(np.concatenate(points), axis=0)))
    boxes_1, boxes_2 = _sorted_boxes(corners[0], axis), _sorted_boxes(corners[-1], axis)
    pairs_by_side = [_begin_within(*boxes_1, *boxes_2, True)]
    # for one body a single pass finds all pairs
    pairs_by_side += [_begin_within(*boxes_2, *boxes_1, False)[:, ::-1]] if len(triangles) == 2 else []
    pairs = np.concatenate(pairs_by_side)
    if len(triangles) == 1:
        pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
    count = len(corners[-1])
    # one number for each pair: pairs of one body are found twice where boxes begin at the same coordinate
    return np.column_stack(np.divmod(np.unique(pairs[:, 0] * count + pairs[:, 1]), count))


def _sorted_boxes(corners: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the boxes (m, 6) of triangles (m, 3, 3), sorted by their lower end along ``axis``, and the order (m,).

    The coordinate along ``axis`` comes first in each box.
    """
    turned = np.roll(corners, -axis, axis=2)
    boxes = np.hstack([turned.min(axis=1), turned.max(axis=1)])
    order = np.argsort(boxes[:, 0], kind="stable")
    return boxes[order], order


@numba.njit(cache=True)
def _begin_within(boxes, order, others, other_order, closed):
    """Pair sorted ``boxes`` with ``others`` that begin inside them on axis 0, or at their lower end if ``closed``.

    boxes, others : (m, 6) lower and upper corners, along axis 0 first; order, other_order : (m,) their triangles
    """
    pairs = np.empty((1024, 2), np.int64)
    count, begin = 0, 0
    for i in range(len(boxes)):
        lower, upper = boxes[i, 0], boxes[i, 3]
        while begin < len(others) and (others[begin, 0] < lower or (not closed and others[begin, 0] == lower)):
            begin += 1
        j = begin
        while j < len(others) and others[j, 0] <= upper:
            if (
                boxes[i, 1] <= others[j, 4]
                and others[j, 1] <= boxes[i, 4]
                and boxes[i, 2] <= others[j, 5]
                and others[j, 2] <= boxes[i, 5]
            ):
                if count == len(pairs):
                    pairs = np.concatenate((pairs, np.empty_like(pairs)))
                pairs[count, 0], pairs[count, 1] = order[i], other_order[j]
                count += 1
            j += 1
    return pairs[:count]
