"""The broad phase: which bodies' roots meet, before anything of their trees is searched."""

from collections.abc import Sequence

import numpy as np

from palpate.collision.trees.build_tree import KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import check_alike
from palpate.collision.trees.volume_overlap import OBB, SPHERE, meet


def meeting(trees: Sequence[Tree]) -> np.ndarray:
    """Pairs (k, 2), i < j, sorted, of trees whose roots meet: at most one test a pair.

    Roots are sorted along x and tested only where their intervals overlap (sweep and prune, Baraff 1992). A tree
    without triangles meets nothing. Raises InputError for structures that cannot be tested against each other.
    """
    chosen = [i for i, tree in enumerate(trees) if len(tree.triangles)]
    if len(chosen) < 2:
        return np.empty((0, 2), np.int64)
    for i in chosen[1:]:
        check_alike(trees[chosen[0]], trees[i])
    low, high = np.array([_interval(trees[i]) for i in chosen]).T
    ranks = np.argsort(low, kind="stable")
    ends = np.searchsorted(low[ranks], high[ranks], side="right")
    pairs = []
    for place, end in enumerate(ends):
        for other in range(place + 1, end):
            i, j = sorted((chosen[ranks[place]], chosen[ranks[other]]))
            if _roots_meet(trees[i], trees[j]):
                pairs.append((i, j))
    return np.array(sorted(pairs), np.int64).reshape(-1, 2)


def _interval(tree: Tree) -> tuple[float, float]:
    """What a root covers of the x-axis, rounded outwards."""
    kind = tree.nodes[0, KIND]
    if kind in (SPHERE, OBB):
        row = (tree.spheres if kind == SPHERE else tree.boxes)[0]
        half = row[3] if kind == SPHERE else np.abs(row[3:12:3]) @ row[12:] * (1.0 + 1e-12)
        return np.nextafter(row[0] - half, -np.inf), np.nextafter(row[0] + half, np.inf)
    row = tree.boxes[0]
    return row[0], row[len(row) // 2]


def _roots_meet(a: Tree, b: Tree) -> bool:
    return meet(a.nodes[0, KIND], b.nodes[0, KIND], a.spheres, b.spheres, a.boxes, b.boxes, 0, 0)
