"""The broad phase against a test of every pair of roots."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palpate.collision.trees import tree_query
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import (
    StoppedTree,
    candidates,
    crossing_pairs,
    overlapping_trees,
    overlaps,
    volume_pairs,
)
from palpate.collision.trees.volumes import KINDS as VOLUMES

TETRAHEDRON = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])


def bodies(structure, count, size):
    rng = np.random.default_rng(0)
    return [Tree(rng.uniform(-5, 5, 3) + size * rng.normal(size=(4, 3)), TETRAHEDRON, structure) for _ in range(count)]


@pytest.mark.parametrize("structure", ["composite", *VOLUMES])
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


def test_bodies_apart_cost_one_test_and_empty_ones_none():
    trees, empty = bodies("composite", 2, 0.1), Tree(np.empty((0, 3)), np.empty((0, 3)))
    trees[1].refit(trees[0].points + 100.0)
    for none in (trees, [], [empty], [empty, empty]):
        assert overlapping_trees(none).shape == (0, 2)
    assert candidates(*trees)[1] == 1
    assert overlapping_trees([trees[0], empty, trees[0]]).tolist() == [[0, 2]]


LAYERS = (0, 1, 3, 6, 99)
KINDS = [("composite", (1, 1)), ("composite", (3, 4)), *((kind, (0, 0)) for kind in ("sphere", "aabb", "obb", "dop14"))]


def bumpy(seed, shift=0.0):
    """Make points and triangles of a bumpy ball."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(150, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    triangles = ConvexHull(points).simplices.astype(np.int64)
    return points * random.uniform(0.8, 1.0, (150, 1)) + [shift, 0.3, 0.2], triangles


@pytest.fixture(scope="module")
def balls():
    return bumpy(1), bumpy(2, 1.3)


@pytest.mark.parametrize("layer", LAYERS)
def test_each_triangle_is_in_one_leaf_of_at_most_as_many_as_the_layer_allows(balls, layer):
    points, triangles = balls[0]
    tree, whole = StoppedTree(points, triangles, layer, "aabb"), Tree(points, triangles, "aabb")
    leaves = tree.leaf_of()
    assert len(np.unique(leaves)) <= 2**layer
    assert tree.height == min(layer, whole.height)
    for leaf in np.unique(leaves):
        corners = points[triangles[leaves == leaf]].reshape(-1, 3)
        assert np.array_equal(tree.boxes[leaf], [*corners.min(axis=0), *corners.max(axis=0)])
    if layer > whole.height:
        assert np.array_equal(tree.nodes, whole.nodes)


@pytest.mark.parametrize(("structure", "depths"), KINDS)
def test_no_crossing_pair_is_outside_the_pairs_of_leaves(balls, structure, depths):
    whole = [Tree(*ball, structure, depths) for ball in balls]
    true, _ = crossing_pairs(*whole)
    assert len(true) > 20
    before = 0
    for layer in LAYERS:
        trees = [StoppedTree(*ball, layer, structure, depths) for ball in balls]
        pairs, tests = volume_pairs(*trees)
        found = {tuple(pair) for pair in pairs.tolist()}
        assert len(found) == len(pairs)
        one, other = (tree.leaf_of()[true[:, side]] for side, tree in enumerate(trees))
        assert set(zip(one.tolist(), other.tolist(), strict=True)) <= found
        assert tests > before or layer == 99
        before = tests
        assert np.array_equal(crossing_pairs(*trees)[0], true)
    # below the whole tree's height leaves are single triangles
    alike = np.column_stack([tree.order[tree.nodes[pairs[:, side], 1]] for side, tree in enumerate(trees)])
    assert np.array_equal(alike[np.lexsort(alike.T[::-1])], candidates(*whole)[0])


def test_a_refit_is_the_same_as_a_new_fit_of_the_same_split(balls):
    points, triangles = balls[0]
    tree = StoppedTree(points, triangles, 4, depths=(2, 2))
    moved = points + 0.05 * np.sin(3.0 * points[:, [1, 2, 0]])
    tree.refit(moved)
    leaves = tree.leaf_of()
    for leaf in np.unique(leaves):
        corners = moved[triangles[leaves == leaf]].reshape(-1, 3)
        assert np.array_equal(tree.boxes[leaf], [*corners.min(axis=0), *corners.max(axis=0)])
    tree.rebuild(moved)
    assert np.array_equal(tree.volumes[:, 0], tree.nodes[:, 0])


CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
ROOT = np.zeros((1, 2), dtype=np.int64)
VOLUME_CONTACTS_STRUCTURES = {"sphere": "sphere", "aabb": "aabb", "both": "composite"}


def tree(points, structure):
    return StoppedTree(points, FACES, 0, VOLUME_CONTACTS_STRUCTURES[structure], (0, 1))


def overlapping(one, points, other, shift):
    one.refit(points + shift)
    return len(volume_pairs(one, other)[0]) > 0


@pytest.mark.parametrize("first", VOLUME_CONTACTS_STRUCTURES)
@pytest.mark.parametrize("second", VOLUME_CONTACTS_STRUCTURES)
def test_the_depth_is_the_way_out(first, second):
    random = np.random.default_rng(3)
    for _ in range(50):
        a, b = (random.uniform(0.3, 1.0, 3) * CORNER + random.uniform(0.0, 0.4, 3) for _ in range(2))
        one, other = tree(a, first), tree(b, second)
        (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
        assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-12) and depth > 0.0
        assert overlapping(one, a, other, (1 - 1e-9) * depth * direction)
        assert not overlapping(one, a, other, (1 + 1e-9) * depth * direction)
        # the other way round it points the other way
        one.refit(a)
        (back,), (turned,), (same,) = overlaps(other, one, ROOT)
        assert same == pytest.approx(depth, rel=1e-12)
        if first == second:
            assert back == pytest.approx(place, abs=1e-12)
        assert turned == pytest.approx(-direction, abs=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "shift", "depth", "way", "place"),
    [
        # spheres about the middle of the box, through the corners
        ("sphere", "sphere", [-1.0, 0.0, 0.0], np.sqrt(3.0) - 1.0, [-1, 0, 0], [0.0, 0.5, 0.5]),
        ("aabb", "aabb", [-0.2, 0.1, -0.7], 0.3, [0, 0, -1], [0.4, 0.55, 0.15]),
        # radius √3/2 about (0.5, 0.5, 1.7), over a box that ends at z = 1
        ("sphere", "aabb", [0.0, 0.0, 1.2], np.sqrt(0.75) - 0.7, [0, 0, 1], [0.5, 0.5, 1.35 - np.sqrt(0.75) / 2]),
    ],
)
def test_overlaps_in_closed_form(first, second, shift, depth, way, place):
    found = overlaps(tree(CORNER + np.array(shift), first), tree(CORNER, second), ROOT)
    for got, expected in zip(found, (place, way, depth), strict=True):
        assert got[0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_one_sphere_in_another_of_the_same_centre():
    one, other = tree(CORNER, "sphere"), tree(0.5 * CORNER + 0.25, "sphere")
    (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
    assert depth == pytest.approx(1.5 * np.sqrt(0.75), rel=1e-12)
    assert np.linalg.norm(direction) == 1.0 and place == pytest.approx([0.5, 0.5, 0.5], abs=1e-12)
