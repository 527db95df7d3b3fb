"""Contacts of two bodies: place, direction, depth and relative velocity, from triangles or from bounding volumes."""

from typing import NamedTuple

import numba
import numpy as np

from palpate.bodies.mesh import corner_normals
from palpate.collision.trees.build_tree import FIRST, LAST
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import Counts, StoppedTree, crossing_pairs, overlaps, volume_pairs
from palpate.collision.triangles.distance import triangle_pairs_distance

FLAT = 1e-12
"""Squared sine of the angle between two edges of a triangle, up to which it counts as a segment."""


class Contacts(NamedTuple):
    """Contacts of a body a with a body b.

    pairs : (k, 2) triangles, or leaves of trees; places : (k, 3) [m]; directions : (k, 3) unit vectors in which a has
    to move to separate; depths : (k,) [m] how far; velocities : (k, 3) [m/s] of a relative to b at the place; so
    velocities along directions are negative where bodies approach
    tests : the cost of the search
    """

    pairs: np.ndarray
    places: np.ndarray
    directions: np.ndarray
    depths: np.ndarray
    velocities: np.ndarray
    tests: Counts


def triangle_contacts(tree_a: Tree, tree_b: Tree, velocity_a: np.ndarray, velocity_b: np.ndarray) -> Contacts:
    """Find the contacts of two closed bodies, one for each pair of triangles that cross (paper 3, chapter 4).

    velocity_a, velocity_b : (n, 3) [m/s] of the points of each tree, interpolated to the place in each triangle
    The place is the middle of the segment that two triangles, which face outward, have in common; direction and depth
    are those of ``ways_out``. Trap: a depth is that of two triangles, so it is never larger than these, however far
    bodies are in each other.
    """
    pairs, counts = crossing_pairs(tree_a, tree_b)
    nodes_a, nodes_b = tree_a.triangles[pairs[:, 0]], tree_b.triangles[pairs[:, 1]]
    _, places, _ = triangle_pairs_distance(tree_a.points[nodes_a], tree_b.points[nodes_b])
    velocities = _interpolated(tree_a.points[nodes_a], velocity_a[nodes_a], places)
    velocities -= _interpolated(tree_b.points[nodes_b], velocity_b[nodes_b], places)
    directions, depths = ways_out(tree_a.points[nodes_a], tree_b.points[nodes_b])
    return Contacts(pairs, places, directions, depths, velocities, counts)


def stopped_contacts(
    tree_a: StoppedTree, tree_b: StoppedTree, velocity_a: np.ndarray, velocity_b: np.ndarray
) -> Contacts:
    """Return one contact for each pair of leaves whose volumes overlap, without any test of triangles.

    velocity_a, velocity_b : (n, 3) [m/s] of the points of each tree, averaged over the triangles of a leaf
    Volumes are spheres and AABBs; direction and depth are those of ``overlaps``. No contact of triangles is missed, and
    none is certain: bodies may be as far apart as volumes are larger than what they hold.
    """
    pairs, tests = volume_pairs(tree_a, tree_b)
    places, directions, depths = overlaps(tree_a, tree_b, pairs)
    velocities = _averaged(tree_a, velocity_a, pairs[:, 0]) - _averaged(tree_b, velocity_b, pairs[:, 1])
    return Contacts(pairs, places, directions, depths, velocities, Counts(tests, 0))


def ways_out(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (k, 3) in which crossing triangles of closed bodies separate, and depths (k,) [m].

    a, b : (k, 3, 3) [m], facing out of the bodies; of two degenerate triangles direction and depth are zero
    The direction is the normal of b, or against that of a, whichever takes less: until a's corners are above b's plane,
    or b's above a's. The least translation in any direction, in contrast, may lead deeper into a body.
    """
    directions, depths, best = np.zeros((len(a), 3)), np.zeros(len(a)), np.full(len(a), np.inf)
    for mover, plane, sign in ((a, b, 1.0), (b, a, -1.0)):
        normals = corner_normals(plane)
        lengths = np.linalg.norm(normals, axis=1)
        normals /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
        below = np.einsum("ki,kci->kc", normals, plane[:, :1] - mover).max(axis=1)
        shorter = (lengths > 0.0) & (below < best)
        best[shorter], directions[shorter], depths[shorter] = below[shorter], sign * normals[shorter], below[shorter]
    return directions, depths


@numba.njit(cache=True)
def _interpolated(corners, values, places):
    """Interpolate values (k, 3, 3) at the corners (k, 3, 3) of triangles linearly to places (k, 3) in them.

    Of a degenerate triangle the edge with the first corner that is longer counts, of a point its first corner.
    """
    at_places = np.empty((len(corners), 3))
    for k in range(len(corners)):
        uu = uv = vv = ud = vd = 0.0
        for axis in range(3):
            start = corners[k, 0, axis]
            u, v, d = corners[k, 1, axis] - start, corners[k, 2, axis] - start, places[k, axis] - start
            uu, uv, vv, ud, vd = uu + u * u, uv + u * v, vv + v * v, ud + u * d, vd + v * d
        weight1 = weight2 = 0.0
        gram = uu * vv - uv * uv
        if gram > FLAT * uu * vv:
            weight1, weight2 = (ud * vv - vd * uv) / gram, (vd * uu - ud * uv) / gram
        elif uu >= vv and uu > 0.0:
            weight1 = ud / uu
        elif vv > 0.0:
            weight2 = vd / vv
        for axis in range(3):
            at_places[k, axis] = (1.0 - weight1 - weight2) * values[k, 0, axis]
            at_places[k, axis] += weight1 * values[k, 1, axis] + weight2 * values[k, 2, axis]
    return at_places


def _averaged(tree: Tree, velocity: np.ndarray, leaves: np.ndarray) -> np.ndarray:
    """Average velocities (n, 3) over the corners of the triangles in each of ``leaves`` (k,)."""
    asked, places = np.unique(leaves, return_inverse=True)
    return _leaf_means(tree.nodes, tree.order, tree.triangles, velocity, asked)[places]


@numba.njit(cache=True)
def _leaf_means(nodes, order, triangles, velocity, leaves):
    """Return the mean ``velocity`` (k, 3) [m/s] of the triangles' corners in each of ``leaves`` (k,)."""
    means = np.zeros((len(leaves), 3))
    for k in range(len(leaves)):
        first, last = nodes[leaves[k], FIRST], nodes[leaves[k], LAST]
        for t in range(first, last):
            for corner in range(3):
                for axis in range(3):
                    means[k, axis] += velocity[triangles[order[t], corner], axis]
        for axis in range(3):
            means[k, axis] /= 3.0 * (last - first)
    return means
