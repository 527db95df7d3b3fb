"""Time a test of two bounding volumes by itself, on the pairs that a search between two trees tests."""

from time import thread_time

import numba
import numpy as np

from palpate.collision.trees.build_tree import CHILD, KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.volumes import volumes_overlap

TESTS = 200_000
"""Tests in a loop that is timed, so that it takes a millisecond or more."""
LOOPS = 5


def nanoseconds(a: Tree, b: Tree) -> float:
    """Return the least processor time of a test [ns] over LOOPS loops through ``searched_pairs``."""
    pairs = searched_pairs(a, b)
    times, many = [], max(1, TESTS // len(pairs))
    arrays = (int(a.nodes[0, KIND]), int(b.nodes[0, KIND]), a.spheres, b.spheres, a.boxes, b.boxes)
    _count(*arrays, pairs, 1)  # compiles
    for _ in range(LOOPS):
        begin = thread_time()
        _count(*arrays, pairs, many)
        times.append((thread_time() - begin) / (many * len(pairs)))
    return 1e9 * min(times)


def searched_pairs(a: Tree, b: Tree) -> np.ndarray:
    """Return the pairs of nodes (k, 2) that a descent from both roots tests: where two overlap, all their children."""
    front, found = np.zeros((1, 2), dtype=np.int64), []
    arrays = (int(a.nodes[0, KIND]), int(b.nodes[0, KIND]), a.spheres, b.spheres, a.boxes, b.boxes)
    while len(front):
        found.append(front)
        here = front[[_count(*arrays, front[i : i + 1], 1) > 0 for i in range(len(front))]]
        down = [[tree.nodes[node, CHILD] for node in column] for tree, column in zip((a, b), here.T, strict=True)]
        front = np.array(
            [
                (x, y)
                for (node_a, node_b), child_a, child_b in zip(here, *down, strict=True)
                if child_a >= 0 or child_b >= 0
                for x in ((child_a, child_a + 1) if child_a >= 0 else (node_a,))
                for y in ((child_b, child_b + 1) if child_b >= 0 else (node_b,))
            ],
            dtype=np.int64,
        ).reshape(-1, 2)
    return np.concatenate(found)


@numba.njit(cache=True)
def _count(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs, times):
    """Count the overlaps; one loop with one kind, as two or an array of kinds takes 15 ns more a test."""
    found, many = 0, len(pairs)
    for k in range(times * many):
        i = k % many
        if volumes_overlap(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs[i, 0], pairs[i, 1]):
            found += 1
    return found
