"""Tree that ends at a chosen layer, whose volumes are taken for what they hold: precision for time."""

import numpy as np

from palpate.collision.trees.build_tree import CHILD, FIRST, KIND, LAST
from palpate.collision.trees.tree import DEPTHS, Tree
from palpate.collision.trees.tree_query import check_comparable, search_nodes
from palpate.errors import InputError


class StoppedTree(Tree):
    """Tree of which only the first ``layer`` levels below the root are kept, as fast to refit as they are few.

    layer : 0 keeps the root alone; one beyond the tree's height keeps all
    The volumes that have no children now hold many triangles; ``volume_pairs`` finds which of them overlap, and
    ``crossing_pairs`` stays exact, at the cost of testing all their triangles. The interruptible search of Hubbard
    (1996) and of O'Sullivan and Dingliana (1999), in the composite hierarchy of paper 3, chapter 4.
    Raises InputError for a layer that is not a count, and as ``Tree`` does.
    """

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        layer: int,
        structure: str = "composite",
        depths: tuple[int, int] = DEPTHS,
        split: str = "sah",
    ):
        if not isinstance(layer, int | np.integer) or layer < 0:
            raise InputError(f"layer of a tree is {layer}; give how many levels are kept below its root, 0 for none.")
        self.layer = layer
        super().__init__(points, triangles, structure, depths, split)

    def _divide(self, boxes: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        nodes, order, height = super()._divide(boxes, centres)
        kept = nodes[:, KIND] <= self.layer
        found, places = nodes[kept], np.cumsum(kept, dtype=np.int32) - 1
        found[found[:, KIND] == self.layer, CHILD] = -1
        inner = found[:, CHILD] >= 0
        found[inner, CHILD] = places[found[inner, CHILD]]
        return found, order, min(height, self.layer)

    def _allocate(self) -> None:
        super()._allocate()
        # a leaf that holds its own number makes a search find pairs of leaves
        self.numbers, self.volumes = np.arange(len(self.nodes), dtype=np.int32), self.nodes.copy()
        leaves = np.flatnonzero(self.nodes[:, CHILD] < 0)
        self.volumes[leaves, FIRST], self.volumes[leaves, LAST] = leaves, leaves + 1

    def leaf_of(self) -> np.ndarray:
        """Return the number (m,) of the leaf that holds each triangle."""
        leaves = np.flatnonzero(self.nodes[:, CHILD] < 0)
        found = np.empty(len(self.triangles), dtype=np.int64)
        sizes = self.nodes[leaves, LAST] - self.nodes[leaves, FIRST]
        in_order = np.argsort(self.nodes[leaves, FIRST], kind="stable")
        found[self.order] = np.repeat(leaves[in_order], sizes[in_order])
        return found


def volume_pairs(tree_a: StoppedTree, tree_b: StoppedTree) -> tuple[np.ndarray, int]:
    """Find the pairs (k, 2) of leaves of two trees that overlap, unsorted, and count the tests of nodes.

    No pair of triangles that intersect is outside the pairs of leaves found. Raises InputError as ``candidates`` does.
    """
    if not len(tree_a.triangles) or not len(tree_b.triangles):
        return np.empty((0, 2), np.int64), 0
    check_comparable(tree_a, tree_b)
    return search_nodes(tree_a, tree_b, False, (tree_a.volumes, tree_a.numbers), (tree_b.volumes, tree_b.numbers))
