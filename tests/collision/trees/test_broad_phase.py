"""The broad phase against a test of every pair of roots."""

from itertools import combinations

import numpy as np
import pytest

from palpate.collision.trees import tree_query
from palpate.collision.trees.tree import STRUCTURES, Tree
from palpate.collision.trees.tree_query import candidates, overlapping_trees
from palpate.errors import InputError

TETRAHEDRON = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])


def bodies(structure, count, size):
    rng = np.random.default_rng(0)
    return [Tree(rng.uniform(-5, 5, 3) + size * rng.normal(size=(4, 3)), TETRAHEDRON, structure) for _ in range(count)]


@pytest.mark.parametrize("structure", STRUCTURES)
def test_pairs_are_exactly_those_of_overlapping_roots(structure, monkeypatch):
    trees = bodies(structure, 40, 1.0)
    expected = [(i, j) for i, j in combinations(range(40), 2) if tree_query._roots_overlap(trees[i], trees[j])]
    tests = []
    monkeypatch.setattr(
        tree_query, "_roots_overlap", lambda a, b, meet=tree_query._roots_overlap: tests.append(1) or meet(a, b)
    )
    pairs = overlapping_trees(trees)
    assert pairs.tolist() == [list(pair) for pair in expected] and 10 < len(pairs) < 600
    assert len(pairs) <= len(tests) < 40 * 39 // 2
    searched = [(i, j) for i, j in combinations(range(40), 2) if len(candidates(trees[i], trees[j])[0])]
    assert set(searched) <= set(expected)


def test_bodies_that_do_not_overlap_cost_no_search_of_their_trees():
    trees = bodies("composite", 2, 0.1)
    trees[1].refit(trees[0].points + 100.0)
    assert overlapping_trees(trees).shape == (0, 2)
    assert candidates(*trees)[1] == 1


def test_empty_and_few_trees():
    empty = Tree(np.empty((0, 3)), np.empty((0, 3)))
    assert (
        overlapping_trees([]).shape
        == overlapping_trees([empty]).shape
        == overlapping_trees([empty, empty]).shape
        == (0, 2)
    )
    tree = bodies("composite", 1, 1.0)[0]
    assert overlapping_trees([tree, empty, tree]).tolist() == [[0, 2]]


def test_structures_that_cannot_be_tested_are_refused():
    with pytest.raises(InputError, match="cannot be searched"):
        overlapping_trees([bodies("obb", 1, 1.0)[0], bodies("dop14", 1, 1.0)[0]])
