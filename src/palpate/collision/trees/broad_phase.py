"""Broad phase: pairs of bodies whose roots overlap, found before their trees are searched."""

from collections.abc import Sequence

import numpy as np

from palpate.collision.trees.build_tree import KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import check_comparable
from palpate.collision.trees.volume_overlap import OBB, SPHERE, volumes_overlap


def overlapping_trees(trees: Sequence[Tree]) -> np.ndarray:
    """Find the pairs (k, 2), i < j, sorted, of trees whose roots overlap, with at most one test per pair.

    Roots are sorted along x and tested only where their intervals overlap (sweep and prune, Baraff 1992). A tree
    without triangles overlaps nothing. Raises InputError for structures that cannot be tested against each other.
    """
    chosen = [i for i, tree in enumerate(trees) if len(tree.triangles)]
    if len(chosen) < 2:
        return np.empty((0, 2), np.int64)
    for i in chosen[1:]:
        check_comparable(trees[chosen[0]], trees[i])
    low, high = np.array([_interval(trees[i]) for i in chosen]).T
    ranks = np.argsort(low, kind="stable")
    ends = np.searchsorted(low[ranks], high[ranks], side="right")
    pairs = []
    for place, end in enumerate(ends):
        for other in range(place + 1, end):
            i, j = sorted((chosen[ranks[place]], chosen[ranks[other]]))
            if _roots_overlap(trees[i], trees[j]):
                pairs.append((i, j))
    return np.array(sorted(pairs), np.int64).reshape(-1, 2)


def _interval(tree: Tree) -> tuple[float, float]:
    """Compute the interval of the x-axis that a root covers, rounded outwards."""
    kind = tree.nodes[0, KIND]
    if kind in (SPHERE, OBB):
        row = (tree.spheres if kind == SPHERE else tree.boxes)[0]
        half = row[3] if kind == SPHERE else np.abs(row[3:12:3]) @ row[12:] * (1.0 + 1e-12)
        return np.nextafter(row[0] - half, -np.inf), np.nextafter(row[0] + half, np.inf)
    row = tree.boxes[0]
    return row[0], row[len(row) // 2]


def _roots_overlap(a: Tree, b: Tree) -> bool:
    return volumes_overlap(a.nodes[0, KIND], b.nodes[0, KIND], a.spheres, b.spheres, a.boxes, b.boxes, 0, 0)
