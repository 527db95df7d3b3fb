"""Overlap of two spheres or AABBs as a contact: its middle, and the shortest way out of it."""

import numba
import numpy as np

from palpate.collision.trees.build_tree import KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.volume_overlap import AABB, BOTH, SPHERE
from palpate.errors import InputError


def overlaps(tree_a: Tree, tree_b: Tree, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find places (k, 3) [m], directions (k, 3) and depths (k,) [m] of the overlaps of nodes ``pairs`` (k, 2).

    The depth is the least translation of a's volume after which both only touch, in that direction; the place is the
    middle of what both have in common, along the line of centres if one is a sphere. Volumes are compared as in the
    search: as spheres if both have one, as AABBs if both have these, else as a sphere and an AABB. Raises InputError
    for a tree of other volumes.
    """
    for tree in (tree_a, tree_b):
        if len(tree.nodes) and tree.nodes[0, KIND] > AABB:
            raise InputError(
                f"a tree of structure {tree.structure} gives no contacts; make it of sphere, aabb or composite."
            )
    places, directions, depths = np.empty((len(pairs), 3)), np.empty((len(pairs), 3)), np.empty(len(pairs))
    _overlaps(
        tree_a.nodes, tree_a.spheres, tree_a.boxes, tree_b.nodes, tree_b.spheres, tree_b.boxes, pairs, places,
        directions, depths,
    )  # fmt: skip
    return places, directions, depths


@numba.njit(cache=True)
def _overlaps(nodes_a, spheres_a, boxes_a, nodes_b, spheres_b, boxes_b, pairs, places, directions, depths):
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        kind_a, kind_b = nodes_a[a, KIND], nodes_b[b, KIND]
        if kind_a <= BOTH and kind_b <= BOTH:
            depths[k] = _of_spheres(spheres_a[a], spheres_b[b], places[k], directions[k])
        elif kind_a != SPHERE and kind_b != SPHERE:
            depths[k] = _of_boxes(boxes_a[a], boxes_b[b], places[k], directions[k])
        elif kind_a == SPHERE:
            depths[k] = _of_sphere_and_box(spheres_a[a], boxes_b[b], places[k], directions[k])
        else:
            depths[k] = _of_sphere_and_box(spheres_b[b], boxes_a[a], places[k], directions[k])
            for axis in range(3):
                directions[k, axis] = -directions[k, axis]


@numba.njit(cache=True)
def _lead(start, end, direction):
    """Write the unit vector between two places, zeros if they are one, and return their distance."""
    square = 0.0
    for axis in range(3):
        direction[axis] = end[axis] - start[axis]
        square += direction[axis] ** 2
    distance = np.sqrt(square)
    if distance > 0.0:
        for axis in range(3):
            direction[axis] /= distance
    return distance


@numba.njit(cache=True)
def _of_spheres(one, other, place, direction):
    """Measure the overlap of two rows (4,); for one centre any direction will do, here z."""
    distance = _lead(other, one, direction)
    if distance == 0.0:
        direction[0], direction[1], direction[2] = 0.0, 0.0, 1.0
    # along the line of centres, from the other's: where both begin and end
    low, high = max(-other[3], distance - one[3]), min(other[3], distance + one[3])
    for axis in range(3):
        place[axis] = other[axis] + 0.5 * (low + high) * direction[axis]
    return max(one[3] + other[3] - distance, 0.0)


@numba.njit(cache=True)
def _of_boxes(one, other, place, direction):
    """Measure the overlap of two rows (6,)."""
    least = np.inf
    direction[:] = 0.0
    chosen, sign = 0, 1.0
    for axis in range(3):
        low, high = max(one[axis], other[axis]), min(one[3 + axis], other[3 + axis])
        place[axis] = 0.5 * (low + high)
        up, down = other[3 + axis] - one[axis], one[3 + axis] - other[axis]
        if min(up, down) < least:
            least, chosen, sign = min(up, down), axis, 1.0 if up <= down else -1.0
    direction[chosen] = sign
    return max(least, 0.0)


@numba.njit(cache=True)
def _of_sphere_and_box(sphere, box, place, direction):
    """Measure the overlap of a row (4,) and a row (6,), in the direction in which the sphere has to move."""
    for axis in range(3):
        place[axis] = min(max(sphere[axis], box[axis]), box[3 + axis])
    distance = _lead(place, sphere, direction)
    if distance > 0.0:
        for axis in range(3):
            # half way from the box's surface to the sphere's
            place[axis] -= 0.5 * (sphere[3] - distance) * direction[axis]
        return max(sphere[3] - distance, 0.0)
    least, chosen, sign = np.inf, 0, 1.0
    for axis in range(3):
        up, down = box[3 + axis] - sphere[axis], sphere[axis] - box[axis]
        if min(up, down) < least:
            least, chosen, sign = min(up, down), axis, 1.0 if up <= down else -1.0
    direction[chosen] = sign
    for axis in range(3):
        # what both have in common, as boxes
        low, high = max(sphere[axis] - sphere[3], box[axis]), min(sphere[axis] + sphere[3], box[3 + axis])
        place[axis] = 0.5 * (low + high)
    return least + sphere[3]
