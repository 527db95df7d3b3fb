"""Bounding trees of several bodies that are refitted as these move."""

from functools import partial
from typing import Any

import numpy as np

from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs


class RefittedTrees:
    """Trees of palpate: built once, then refitted, and rebuilt when a tree reports that its quality has fallen.

    layer : the one at which the trees are stopped; None for whole trees
    """

    refits = True

    def __init__(
        self, structure: str, depths: tuple[int, int] | None, triangles: list, points: list, layer: int | None = None
    ):
        from palpate.collision.trees.tree_query import StoppedTree

        more: dict[str, Any] = {"depths": depths} if depths else {}
        make = Tree if layer is None else partial(StoppedTree, layer=layer)
        self.trees = [make(at, cells, structure=structure, **more) for at, cells in zip(points, triangles, strict=True)]
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
