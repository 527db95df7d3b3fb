"""Search of two trees, or of one with itself, for pairs of triangles that may intersect, and for those that do.

Before it, the broad phase finds pairs of bodies whose roots overlap. A stopped tree ends at a chosen layer, and takes
volumes for what they hold: precision for time.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.trees.build_tree import CHILD, FIRST, KIND, LAST
from palpate.collision.trees.tree import DEPTHS, Tree
from palpate.collision.trees.volumes import AABB, BOTH, OBB, SPHERE, volumes_overlap
from palpate.collision.triangles.intersection import pairs_intersect
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
    other = tree_a if tree_b is None else tree_b
    pairs, tests = _search(tree_a, other, tree_b is None)
    hits = pairs[pairs_intersect(tree_a.points, tree_a.triangles, other.points, other.triangles, pairs)]
    return _sorted(hits, len(other.triangles)), Counts(tests, len(pairs))


def _search(tree_a: Tree, tree_b: Tree, same: bool) -> tuple[np.ndarray, int]:
    return search_nodes(tree_a, tree_b, same, (tree_a.nodes, tree_a.order), (tree_b.nodes, tree_b.order))


def search_nodes(
    tree_a: Tree,
    tree_b: Tree,
    same: bool,
    within: tuple[np.ndarray, np.ndarray],
    others: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, int]:
    """Find pairs (k, 2), unsorted, of the items in overlapping leaves of two trees, and count the tests of nodes.

    within, others : nodes and items of each tree: triangles, or leaves themselves; same : whether both trees are one
    Raises InputError unless the volumes of both trees can be tested against each other.
    """
    if not len(tree_a.triangles) or not len(tree_b.triangles):
        return np.empty((0, 2), np.int64), 0
    check_comparable(tree_a, tree_b)
    side_a = (*within, tree_a.spheres, tree_a.boxes)
    side_b = (*others, tree_b.spheres, tree_b.boxes)
    stack = np.empty((4 * (tree_a.height + tree_b.height) + 8, 2), np.int32)
    pairs = np.empty((2 * (len(tree_a.triangles) + len(tree_b.triangles)) + 1024, 2), np.int64)
    count, tests = _find(*side_a, *side_b, tree_a.triangles, same, stack, pairs)
    if count > len(pairs):
        pairs = np.empty((count, 2), np.int64)
        _find(*side_a, *side_b, tree_a.triangles, same, stack, pairs)
    return pairs[:count], tests


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
    count, tests, depth = 0, 0, 1
    stack[0, 0] = stack[0, 1] = 0
    if not same:
        tests += 1
        depth = int(volumes_overlap(nodes_a[0, KIND], nodes_b[0, KIND], spheres_a, spheres_b, boxes_a, boxes_b, 0, 0))
    while depth:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        left_a, left_b = nodes_a[a, CHILD], nodes_b[b, CHILD]
        larger = nodes_a[a, LAST] - nodes_a[a, FIRST] >= nodes_b[b, LAST] - nodes_b[b, FIRST]
        if left_a < 0 and left_b < 0:
            for i in range(nodes_a[a, FIRST], nodes_a[a, LAST]):
                for j in range(nodes_b[b, FIRST], nodes_b[b, LAST]):
                    t, u = order_a[i], order_b[j]
                    if same and ((a == b and t >= u) or _share_node(triangles, t, u)):
                        continue
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1] = (min(t, u), max(t, u)) if same else (t, u)
                    count += 1
        elif same and a == b:
            for child in range(left_a, left_a + 2):
                stack[depth, 0] = stack[depth, 1] = child
                depth += 1
            tests += 1
            kind = nodes_a[left_a, KIND]
            if volumes_overlap(kind, kind, spheres_a, spheres_a, boxes_a, boxes_a, left_a, left_a + 1):
                stack[depth, 0], stack[depth, 1] = left_a, left_a + 1
                depth += 1
        elif left_b < 0 or (left_a >= 0 and larger):
            tests += 2
            kind = nodes_b[b, KIND]
            for child in range(left_a, left_a + 2):
                if volumes_overlap(nodes_a[child, KIND], kind, spheres_a, spheres_b, boxes_a, boxes_b, child, b):
                    stack[depth, 0], stack[depth, 1] = child, b
                    depth += 1
        else:
            tests += 2
            kind = nodes_a[a, KIND]
            for child in range(left_b, left_b + 2):
                if volumes_overlap(kind, nodes_b[child, KIND], spheres_a, spheres_b, boxes_a, boxes_b, a, child):
                    stack[depth, 0], stack[depth, 1] = a, child
                    depth += 1
    return count, tests


@numba.njit(cache=True, forceinline=True)
def _share_node(triangles, t, u):
    for p in range(3):
        for q in range(3):
            if triangles[t, p] == triangles[u, q]:
                return True
    return False


class StoppedTree(Tree):
    """Tree of which only the first ``layer`` levels below the root are kept, as fast to refit as they are few.

    layer : 0 keeps the root alone; one beyond the tree's height keeps all
    The volumes that have no children now hold many triangles; ``volume_pairs`` finds which of them overlap, and
    ``crossing_pairs`` stays exact, at the cost of testing all their triangles. The interruptible search of Hubbard
    (1996) and of O'Sullivan and Dingliana (1999), in the composite hierarchy of paper 3, chapter 4.
    Raises InputError as ``Tree`` does.
    """

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        layer: int,
        structure: str = "composite",
        depths: tuple[int, int] = DEPTHS,
    ):
        self.layer = layer
        super().__init__(points, triangles, structure, depths)

    def _divide(self, boxes: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        nodes, order, height = super()._divide(boxes, centres)
        kept = nodes[:, KIND] <= self.layer
        remaining, places = nodes[kept], np.cumsum(kept, dtype=np.int32) - 1
        remaining[remaining[:, KIND] == self.layer, CHILD] = -1
        inner = remaining[:, CHILD] >= 0
        remaining[inner, CHILD] = places[remaining[inner, CHILD]]
        return remaining, order, min(height, self.layer)

    def _allocate(self) -> None:
        super()._allocate()
        # a leaf that holds its own number makes a search find pairs of leaves
        self.numbers, self.volumes = np.arange(len(self.nodes), dtype=np.int32), self.nodes.copy()
        leaves = np.flatnonzero(self.nodes[:, CHILD] < 0)
        self.volumes[leaves, FIRST], self.volumes[leaves, LAST] = leaves, leaves + 1

    def leaf_of(self) -> np.ndarray:
        """Return the number (m,) of the leaf that holds each triangle."""
        leaves = np.flatnonzero(self.nodes[:, CHILD] < 0)
        leaf_numbers = np.empty(len(self.triangles), dtype=np.int64)
        sizes = self.nodes[leaves, LAST] - self.nodes[leaves, FIRST]
        in_order = np.argsort(self.nodes[leaves, FIRST], kind="stable")
        leaf_numbers[self.order] = np.repeat(leaves[in_order], sizes[in_order])
        return leaf_numbers


def volume_pairs(tree_a: StoppedTree, tree_b: StoppedTree) -> tuple[np.ndarray, int]:
    """Find the pairs (k, 2) of leaves of two trees that overlap, unsorted, and count the tests of nodes.

    No pair of triangles that intersect is outside the pairs of leaves found. Raises InputError as ``candidates`` does.
    """
    return search_nodes(tree_a, tree_b, False, (tree_a.volumes, tree_a.numbers), (tree_b.volumes, tree_b.numbers))


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
    starts, stops = np.array([_interval(trees[i]) for i in chosen]).T
    ranks = np.argsort(starts, kind="stable")
    ends = np.searchsorted(starts[ranks], stops[ranks], side="right")
    pairs = []
    for rank, end in enumerate(ends):
        for other in range(rank + 1, end):
            i, j = sorted((chosen[ranks[rank]], chosen[ranks[other]]))
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


def overlaps(tree_a: Tree, tree_b: Tree, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find places (k, 3) [m], directions (k, 3) and depths (k,) [m] of the overlaps of nodes ``pairs`` (k, 2).

    The depth is the least translation of a's volume after which both only touch, in that direction; the place is the
    middle of what both have in common, along the line of centres if one is a sphere. Volumes are compared as in the
    search: as spheres if both have one, as AABBs if both have these, else as a sphere and an AABB; there are no others.
    """
    return _overlaps(tree_a.nodes, tree_a.spheres, tree_a.boxes, tree_b.nodes, tree_b.spheres, tree_b.boxes, pairs)


@numba.njit(cache=True)
def _overlaps(nodes_a, spheres_a, boxes_a, nodes_b, spheres_b, boxes_b, pairs):
    """Return places (k, 3), directions (k, 3) in which a leaves, and depths (k,) of overlaps of nodes, ``pairs``."""
    places, directions, depths = np.empty((len(pairs), 3)), np.empty((len(pairs), 3)), np.empty(len(pairs))
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
    return places, directions, depths


@numba.njit(cache=True)
def _lead(start, end, direction):
    """Write the unit vector from ``start`` to ``end``, zeros if they are one place, and return their distance."""
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
def _of_spheres(a, b, place, direction):
    """Write the place where two spheres (4,) overlap, and a's way out, along z if concentric; return the depth."""
    distance = _lead(b, a, direction)
    if distance == 0.0:
        direction[0], direction[1], direction[2] = 0.0, 0.0, 1.0
    # along the line of centres from that of b: where the overlap begins and ends
    begin, end = max(-b[3], distance - a[3]), min(b[3], distance + a[3])
    for axis in range(3):
        place[axis] = b[axis] + 0.5 * (begin + end) * direction[axis]
    return max(a[3] + b[3] - distance, 0.0)


@numba.njit(cache=True)
def _of_boxes(a, b, place, direction):
    """Write the place where two AABBs (6,) overlap, and the direction of a's shortest way out; return the depth."""
    depth = np.inf
    direction[:] = 0.0
    chosen, sign = 0, 1.0
    for axis in range(3):
        begin, end = max(a[axis], b[axis]), min(a[3 + axis], b[3 + axis])
        place[axis] = 0.5 * (begin + end)
        up, down = b[3 + axis] - a[axis], a[3 + axis] - b[axis]
        if min(up, down) < depth:
            depth, chosen, sign = min(up, down), axis, 1.0 if up <= down else -1.0
    direction[chosen] = sign
    return max(depth, 0.0)


@numba.njit(cache=True)
def _of_sphere_and_box(sphere, box, place, direction):
    """Write place and direction of the overlap of a sphere (4,), which moves, and an AABB (6,); return its depth."""
    for axis in range(3):
        place[axis] = min(max(sphere[axis], box[axis]), box[3 + axis])
    distance = _lead(place, sphere, direction)
    if distance > 0.0:
        for axis in range(3):
            # half way from the box's surface to the sphere's
            place[axis] -= 0.5 * (sphere[3] - distance) * direction[axis]
        return max(sphere[3] - distance, 0.0)
    depth, chosen, sign = np.inf, 0, 1.0
    for axis in range(3):
        up, down = box[3 + axis] - sphere[axis], sphere[axis] - box[axis]
        if min(up, down) < depth:
            depth, chosen, sign = min(up, down), axis, 1.0 if up <= down else -1.0
    direction[chosen] = sign
    for axis in range(3):
        # what both have in common, as boxes
        begin, end = max(sphere[axis] - sphere[3], box[axis]), min(sphere[axis] + sphere[3], box[3 + axis])
        place[axis] = 0.5 * (begin + end)
    return depth + sphere[3]


class RefittedTrees:
    """Trees of several bodies: built once, then refitted, and rebuilt when a tree reports that its quality has fallen.

    depths : of composite trees; None for the usual ones; layer : at which trees are stopped; None for whole trees
    """

    refits = True

    def __init__(
        self, structure: str, depths: tuple[int, int] | None, triangles: list, points: list, layer: int | None = None
    ):
        how = structure, depths or DEPTHS
        self.trees = [
            Tree(at, cells, *how) if layer is None else StoppedTree(at, cells, layer, *how)
            for at, cells in zip(points, triangles, strict=True)
        ]
        self.rebuilds = 0

    def update(self, points: list[np.ndarray]) -> None:
        """Refit the trees to the new ``points`` of each body, (n, 3) [m]; rebuild those that are worn."""
        for tree, moved in zip(self.trees, points, strict=True):
            tree.refit(moved)
            if tree.needs_rebuild:
                tree.rebuild(moved)
                self.rebuilds += 1

    def query(self) -> np.ndarray:
        """Return the crossing pairs, (k, 2) int64, and keep the numbers of tests in ``counts``."""
        pairs, self.counts = crossing_pairs(*self.trees)
        return pairs
