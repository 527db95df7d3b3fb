"""Searching two trees, or one with itself, for pairs of triangles that may meet, and for those that do."""

from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.trees.build_tree import CHILD, FIRST, KIND, LAST
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.volume_overlap import AABB, meet
from palpate.errors import InputError


class Counts(NamedTuple):
    """What a search cost: tests of two nodes, and of two triangles."""

    node_tests: int
    triangle_tests: int


def candidates(tree_a: Tree, tree_b: Tree) -> tuple[np.ndarray, int]:
    """Pairs (k, 2) of a triangle of each tree whose leaves meet, sorted, and how many pairs of nodes were tested.

    Raises InputError for an OBB tree or k-DOPs against another structure; spheres, AABBs and composites go together.
    """
    pairs, tests = _search(tree_a, tree_b, False)
    return _sorted(pairs, len(tree_b.triangles)), tests


def self_candidates(tree: Tree) -> tuple[np.ndarray, int]:
    """Pairs (k, 2), i < j, of a tree's triangles that share no node and whose leaves meet, sorted; tests of nodes."""
    pairs, tests = _search(tree, tree, True)
    return _sorted(pairs, len(tree.triangles)), tests


def crossing_pairs(tree_a: Tree, tree_b: Tree | None = None) -> tuple[np.ndarray, Counts]:
    """Pairs (k, 2) of triangles that meet, sorted, by exact tests at the points the trees were last fitted to.

    Without ``tree_b`` pairs i < j of one tree's own, except those that share a node. Touching counts as meeting.
    """
    from palpate.collision.triangles.triangle_pairs import crosses

    other = tree_a if tree_b is None else tree_b
    pairs, tests = _search(tree_a, other, tree_b is None)
    hits = pairs[crosses(tree_a.points, tree_a.triangles, other.points, other.triangles, pairs)]
    return _sorted(hits, len(other.triangles)), Counts(tests, len(pairs))


def _search(tree_a: Tree, tree_b: Tree, same: bool) -> tuple[np.ndarray, int]:
    for tree in (tree_a, tree_b):
        if not isinstance(tree, Tree):
            raise InputError(f"a search was given a {type(tree).__name__} for a tree; make a Tree of its triangles.")
    if not len(tree_a.triangles) or not len(tree_b.triangles):
        return np.empty((0, 2), np.int64), 0
    check_alike(tree_a, tree_b)
    one = (tree_a.nodes, tree_a.order, tree_a.spheres, tree_a.boxes)
    other = (tree_b.nodes, tree_b.order, tree_b.spheres, tree_b.boxes)
    stack = np.empty((4 * (tree_a.height + tree_b.height) + 8, 2), np.int32)
    pairs = np.empty((2 * (len(tree_a.triangles) + len(tree_b.triangles)) + 1024, 2), np.int64)
    found, tests = _find(*one, *other, tree_a.triangles, same, stack, pairs)
    if found > len(pairs):
        pairs = np.empty((found, 2), np.int64)
        _find(*one, *other, tree_a.triangles, same, stack, pairs)
    return pairs[:found], tests


def check_alike(tree_a: Tree, tree_b: Tree) -> None:
    """Raise InputError unless the volumes of both trees can be tested against each other."""
    kinds = max(tree_a.nodes[0, KIND], AABB), max(tree_b.nodes[0, KIND], AABB)
    if kinds[0] != kinds[1]:
        raise InputError(
            f"a tree of structure {tree_a.structure} cannot be searched against one of {tree_b.structure}; "
            "give both the same."
        )


def _sorted(pairs: np.ndarray, columns: int) -> np.ndarray:
    keys = pairs[:, 0] * columns + pairs[:, 1]
    keys.sort()
    return np.column_stack(np.divmod(keys, max(columns, 1)))


@numba.njit(cache=True)
def _find(nodes_a, order_a, spheres_a, boxes_a, nodes_b, order_b, spheres_b, boxes_b, triangles, same, stack, pairs):
    """Write pairs as long as there is room; how many there are, and how many tests of nodes that took.

    ``same``: both trees are one, of ``triangles``. Of two nodes that meet the larger gives way to its children.
    """
    found, tests, depth = 0, 0, 1
    stack[0, 0] = stack[0, 1] = 0
    if not same:
        tests += 1
        depth = int(meet(nodes_a[0, KIND], nodes_b[0, KIND], spheres_a, spheres_b, boxes_a, boxes_b, 0, 0))
    while depth:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        down_a, down_b = nodes_a[a, CHILD], nodes_b[b, CHILD]
        larger = nodes_a[a, LAST] - nodes_a[a, FIRST] >= nodes_b[b, LAST] - nodes_b[b, FIRST]
        if down_a < 0 and down_b < 0:
            for i in range(nodes_a[a, FIRST], nodes_a[a, LAST]):
                for j in range(nodes_b[b, FIRST], nodes_b[b, LAST]):
                    t, u = order_a[i], order_b[j]
                    if same and ((a == b and t >= u) or _neighbours(triangles, t, u)):
                        continue
                    if found < len(pairs):
                        pairs[found, 0], pairs[found, 1] = (min(t, u), max(t, u)) if same else (t, u)
                    found += 1
        elif same and a == b:
            for child in range(down_a, down_a + 2):
                stack[depth, 0] = stack[depth, 1] = child
                depth += 1
            tests += 1
            kind = nodes_a[down_a, KIND]
            if meet(kind, kind, spheres_a, spheres_a, boxes_a, boxes_a, down_a, down_a + 1):
                stack[depth, 0], stack[depth, 1] = down_a, down_a + 1
                depth += 1
        elif down_b < 0 or (down_a >= 0 and larger):
            tests += 2
            kind = nodes_b[b, KIND]
            for child in range(down_a, down_a + 2):
                if meet(nodes_a[child, KIND], kind, spheres_a, spheres_b, boxes_a, boxes_b, child, b):
                    stack[depth, 0], stack[depth, 1] = child, b
                    depth += 1
        else:
            tests += 2
            kind = nodes_a[a, KIND]
            for child in range(down_b, down_b + 2):
                if meet(kind, nodes_b[child, KIND], spheres_a, spheres_b, boxes_a, boxes_b, a, child):
                    stack[depth, 0], stack[depth, 1] = a, child
                    depth += 1
    return found, tests


@numba.njit(cache=True, forceinline=True)
def _neighbours(triangles, t, u):
    """Whether two triangles share a node."""
    for p in range(3):
        for q in range(3):
            if triangles[t, p] == triangles[u, q]:
                return True
    return False
