"""A stopped tree keeps its first layers: every triangle is in one leaf, and no crossing pair is outside those found."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree, candidates, crossing_pairs, volume_pairs
from palpate.errors import InputError

LAYERS = (0, 1, 3, 6, 99)
KINDS = [
    ("sphere", (0, 0)),
    ("aabb", (0, 0)),
    ("composite", (1, 1)),
    ("composite", (3, 4)),
    ("obb", (0, 0)),
    ("dop14", (0, 0)),
]


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


def test_an_empty_tree_overlaps_nothing(balls):
    nothing = StoppedTree(np.zeros((0, 3)), [], 3)
    pairs, tests = volume_pairs(nothing, StoppedTree(*balls[0], 3))
    assert pairs.shape == (0, 2) and tests == 0


@pytest.mark.parametrize("layer", [-1, 1.5, None, "2"])
def test_a_layer_is_a_count(balls, layer):
    with pytest.raises(InputError, match="give how many levels are kept below its root"):
        StoppedTree(*balls[0], layer)


def test_volumes_of_other_kinds_are_refused(balls):
    with pytest.raises(InputError, match="cannot be searched against"):
        volume_pairs(StoppedTree(*balls[0], 2, "obb"), StoppedTree(*balls[1], 2, "aabb"))
