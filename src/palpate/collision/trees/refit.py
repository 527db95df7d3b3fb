"""Refit of a tree's volumes to moved triangles, from the leaves up."""

import numba
import numpy as np

from palpate.collision.trees.build_tree import CHILD, FIRST, KIND, LAST
from palpate.collision.trees.fit_volumes import ULP, fit_box, fit_dop, fit_sphere, merge_bounds
from palpate.collision.trees.volume_overlap import BOTH


@numba.njit(cache=True)
def gather_corners(points, moved, triangles, corners):
    """Gather the corners of the leaves' triangles in order: three of ``points``, and three of ``moved`` if it has any.

    corners : (m * per_triangle, 3), overwritten; a node's corners are one range of them
    Returns whether all are finite.
    """
    per_triangle, total = 6 if len(moved) else 3, 0.0
    for t in range(len(triangles)):
        for k in range(3):
            p = triangles[t, k]
            for i in range(3):
                corners[per_triangle * t + k, i] = points[p, i]
                total += 0.0 * points[p, i]
            if per_triangle == 6:
                for i in range(3):
                    corners[6 * t + 3 + k, i] = moved[p, i]
                    total += 0.0 * moved[p, i]
    return total == 0.0


@numba.njit(cache=True)
def refit_boxes(nodes, corners, per_triangle, pad, boxes, spheres):
    """Refit AABBs of all nodes from their children's, and spheres of those that have one.

    A sphere is centred in the AABB and reaches the farthest of all the node's corners: O(m) per level, and much tighter
    than around its children's spheres, whose slack adds up.
    """
    for n in range(len(nodes) - 1, -1, -1):
        first, last = per_triangle * nodes[n, FIRST], per_triangle * nodes[n, LAST]
        if nodes[n, CHILD] < 0:
            fit_box(corners, first, last, boxes, n)
            for i in range(3):
                boxes[n, i] -= pad
                boxes[n, 3 + i] += pad
        else:
            merge_bounds(3, boxes, n, nodes[n, CHILD])
        if nodes[n, KIND] <= BOTH:
            for i in range(3):
                spheres[n, i] = 0.5 * boxes[n, i] + 0.5 * boxes[n, 3 + i]
            fit_sphere(corners, first, last, spheres, n)
            spheres[n, 3] += pad


@numba.njit(cache=True)
def refit_dops(nodes, corners, per_triangle, pad, directions, boxes):
    """Refit k-DOPs: of leaves around their corners, of other nodes around their children's, which is lossless."""
    half = len(directions)
    for n in range(len(nodes) - 1, -1, -1):
        if nodes[n, CHILD] < 0:
            fit_dop(corners, per_triangle * nodes[n, FIRST], per_triangle * nodes[n, LAST], directions, boxes, n)
            for k in range(half):
                length = np.sqrt(directions[k, 0] ** 2 + directions[k, 1] ** 2 + directions[k, 2] ** 2)
                boxes[n, k] -= pad * length * (1.0 + ULP)
                boxes[n, half + k] += pad * length * (1.0 + ULP)
        else:
            merge_bounds(half, boxes, n, nodes[n, CHILD])


@numba.njit(cache=True)
def box_areas(nodes, corners, per_triangle):
    """Sum the surface of the AABBs of all nodes at ``points`` alone, relative to the root's: the cost of a search.

    0 where the root has no surface.
    """
    boxes, total, area = np.empty((len(nodes), 6)), 0.0, 0.0
    for n in range(len(nodes) - 1, -1, -1):
        if nodes[n, CHILD] < 0:
            start = per_triangle * nodes[n, FIRST]
            fit_box(corners, start, start + 3, boxes, n)
            for t in range(nodes[n, FIRST] + 1, nodes[n, LAST]):
                for k in range(per_triangle * t, per_triangle * t + 3):
                    for i in range(3):
                        boxes[n, i] = min(boxes[n, i], corners[k, i])
                        boxes[n, 3 + i] = max(boxes[n, 3 + i], corners[k, i])
        else:
            merge_bounds(3, boxes, n, nodes[n, CHILD])
        x, y, z = boxes[n, 3] - boxes[n, 0], boxes[n, 4] - boxes[n, 1], boxes[n, 5] - boxes[n, 2]
        area = x * y + y * z + z * x
        total += area
    return total / area if area > 0.0 and total < np.inf else 0.0
