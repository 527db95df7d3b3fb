"""Search of two trees, or of one with itself, for pairs of triangles that may intersect, and for those that do."""

from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.trees.build_tree import CHILD, FIRST, KIND, LAST
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.volume_overlap import AABB, volumes_overlap
from palpate.errors import InputError


class Counts(NamedTuple):
    """Cost of a search: tests of two nodes, and of two triangles."""

    node_tests: int
    triangle_tests: int


def candidates(tree_a: Tree, tree_b: Tree) -> tuple[np.ndarray, int]:
    """Find the pairs (k, 2) of triangles of two trees whose leaves overlap, sorted, and count the tests of nodes.

    Raises InputError for an OBB tree or k-DOPs against another structure; spheres, AABBs and composites can be mixed.
    """
    pairs, tests = _search(tree_a, tree_b, False)
    return _sorted(pairs, len(tree_b.triangles)), tests


def self_candidates(tree: Tree) -> tuple[np.ndarray, int]:
    """Find the pairs (k, 2), i < j, of a tree's triangles without a common node whose leaves overlap; count tests."""
    pairs, tests = _search(tree, tree, True)
    return _sorted(pairs, len(tree.triangles)), tests


def crossing_pairs(tree_a: Tree, tree_b: Tree | None = None) -> tuple[np.ndarray, Counts]:
    """Find the pairs (k, 2) of triangles that intersect, sorted, by exact tests at the points of the last fit.

    Without ``tree_b`` pairs i < j of one tree, except those that share a node. Touching counts as intersecting.
    """
    from palpate.collision.triangles.triangle_pairs import pairs_intersect

    other = tree_a if tree_b is None else tree_b
    pairs, tests = _search(tree_a, other, tree_b is None)
    hits = pairs[pairs_intersect(tree_a.points, tree_a.triangles, other.points, other.triangles, pairs)]
    return _sorted(hits, len(other.triangles)), Counts(tests, len(pairs))


def _search(tree_a: Tree, tree_b: Tree, same: bool) -> tuple[np.ndarray, int]:
    for tree in (tree_a, tree_b):
        if not isinstance(tree, Tree):
            raise InputError(f"a search was given a {type(tree).__name__} for a tree; make a Tree of its triangles.")
    if not len(tree_a.triangles) or not len(tree_b.triangles):
        return np.empty((0, 2), np.int64), 0
    check_comparable(tree_a, tree_b)
    return search_nodes(tree_a, tree_b, same, (tree_a.nodes, tree_a.order), (tree_b.nodes, tree_b.order))


def search_nodes(
    tree_a: Tree,
    tree_b: Tree,
    same: bool,
    within: tuple[np.ndarray, np.ndarray],
    others: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, int]:
    """Find pairs (k, 2), unsorted, of what the overlapping leaves of two trees hold, and count the tests of nodes.

    within, others : nodes and order of each tree, or others of the same shape; same : whether both trees are one
    """
    one = (*within, tree_a.spheres, tree_a.boxes)
    other = (*others, tree_b.spheres, tree_b.boxes)
    stack = np.empty((4 * (tree_a.height + tree_b.height) + 8, 2), np.int32)
    pairs = np.empty((2 * (len(tree_a.triangles) + len(tree_b.triangles)) + 1024, 2), np.int64)
    found, tests = _find(*one, *other, tree_a.triangles, same, stack, pairs)
    if found > len(pairs):
        pairs = np.empty((found, 2), np.int64)
        _find(*one, *other, tree_a.triangles, same, stack, pairs)
    return pairs[:found], tests


def check_comparable(tree_a: Tree, tree_b: Tree) -> None:
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
    """Write pairs while there is room; return their number, and the number of node tests.

    ``same``: both trees are one, of ``triangles``. Of two nodes that overlap the larger is replaced by its children.
    """
    found, tests, depth = 0, 0, 1
    stack[0, 0] = stack[0, 1] = 0
    if not same:
        tests += 1
        depth = int(volumes_overlap(nodes_a[0, KIND], nodes_b[0, KIND], spheres_a, spheres_b, boxes_a, boxes_b, 0, 0))
    while depth:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        down_a, down_b = nodes_a[a, CHILD], nodes_b[b, CHILD]
        larger = nodes_a[a, LAST] - nodes_a[a, FIRST] >= nodes_b[b, LAST] - nodes_b[b, FIRST]
        if down_a < 0 and down_b < 0:
            for i in range(nodes_a[a, FIRST], nodes_a[a, LAST]):
                for j in range(nodes_b[b, FIRST], nodes_b[b, LAST]):
                    t, u = order_a[i], order_b[j]
                    if same and ((a == b and t >= u) or _share_node(triangles, t, u)):
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
            if volumes_overlap(kind, kind, spheres_a, spheres_a, boxes_a, boxes_a, down_a, down_a + 1):
                stack[depth, 0], stack[depth, 1] = down_a, down_a + 1
                depth += 1
        elif down_b < 0 or (down_a >= 0 and larger):
            tests += 2
            kind = nodes_b[b, KIND]
            for child in range(down_a, down_a + 2):
                if volumes_overlap(nodes_a[child, KIND], kind, spheres_a, spheres_b, boxes_a, boxes_b, child, b):
                    stack[depth, 0], stack[depth, 1] = child, b
                    depth += 1
        else:
            tests += 2
            kind = nodes_a[a, KIND]
            for child in range(down_b, down_b + 2):
                if volumes_overlap(kind, nodes_b[child, KIND], spheres_a, spheres_b, boxes_a, boxes_b, a, child):
                    stack[depth, 0], stack[depth, 1] = a, child
                    depth += 1
    return found, tests


@numba.njit(cache=True, forceinline=True)
def _share_node(triangles, t, u):
    """Test whether two triangles share a node."""
    for p in range(3):
        for q in range(3):
            if triangles[t, p] == triangles[u, q]:
                return True
    return False
