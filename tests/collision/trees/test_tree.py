"""Trees: the pairs they find against all pairs, in hundreds of frames, for every structure; degradation; bad input."""

import numpy as np
import pytest

from palpate.collision.trees.tree import REBUILD_QUALITY, Tree
from palpate.collision.trees.tree_query import candidates, crossing_pairs, self_candidates
from palpate.collision.trees.volumes import KINDS as VOLUMES
from palpate.errors import InputError
from palpate.studies.brute_force import crossing
from palpate.studies.prescribed_motions import (
    folding_sheet,
    instrument_press,
    liver_surface,
    random_soup,
    two_livers,
)

FRAMES = 200
KINDS = [(name, (3, 2)) for name in ("composite", *VOLUMES)]
KINDS += [("composite", depths) for depths in ((0, 0), (0, 4), (4, 0), (2, 20), (30, 0))]


@pytest.fixture(scope="module")
def organ():
    return liver_surface(0)


@pytest.mark.parametrize(
    "scene", [two_livers(0), instrument_press(0), folding_sheet(8), random_soup(150, 8)], ids=lambda scene: scene.name
)
def test_pairs_are_all_pairs_in_every_frame(scene):
    trees, found = None, []
    for time in np.linspace(0.0, 1.0, FRAMES):
        points = scene.at(time)
        each = list(zip(points, scene.triangles, strict=True))
        trees = trees or [[Tree(*body, *kind) for body in each] for kind in KINDS]
        expected = crossing(points, scene.triangles)
        found.append(len(expected))
        for searched in trees:
            for tree, moved in zip(searched, points, strict=True):
                tree.refit(moved)
            pairs, counts = crossing_pairs(*searched)
            assert np.array_equal(pairs, expected), (searched[0].structure, searched[0].depths)
            assert counts.node_tests <= 4 * len(scene.triangles[0]) * len(scene.triangles[-1])
            assert len(pairs) <= counts.triangle_tests
    assert np.mean(found) > 5 and max(found) > 20


def test_structures_with_spheres_and_boxes_can_be_mixed(organ):
    points, triangles = organ
    moved = np.add(points, [0.01, 0.06, 0.02])
    expected = crossing([points, moved], [triangles, triangles])
    assert len(expected) > 20
    alike = [Tree(points, triangles, *kind) for kind in KINDS if kind[0] in ("sphere", "aabb", "composite")]
    for one in alike:
        for two in alike:
            two.refit(moved)
            one.refit(points)
            if one is not two:
                assert np.array_equal(crossing_pairs(one, two)[0], expected)
    with pytest.raises(InputError, match="cannot be searched"):
        candidates(Tree(points, triangles, "obb"), Tree(points, triangles, "aabb"))


@pytest.mark.parametrize("kind", KINDS)
def test_inflated_trees_find_all_that_is_nearer_than_both_margins(kind):
    rng, margin = np.random.default_rng(9), 0.1
    triangles = np.arange(120).reshape(-1, 3)
    points = [np.repeat(rng.uniform(-1, 1, (40, 3)), 3, axis=0) + 0.1 * rng.normal(size=(120, 3)) for _ in range(2)]
    trees = [Tree(x, triangles, *kind) for x in points]
    for tree, x in zip(trees, points, strict=True):
        tree.refit(x, margin)
    found = {tuple(pair) for pair in candidates(*trees)[0]}
    a, b = (np.einsum("kc,tci->tki", rng.dirichlet([0.5] * 3, 12), x[triangles]) for x in points)
    apart = np.linalg.norm(a[:, None, :, None] - b[None, :, None, :], axis=-1).min(axis=(2, 3))
    near = {tuple(pair) for pair in np.argwhere(apart <= 2 * margin)}
    assert len(near) > 5 and near <= found


@pytest.mark.parametrize("kind", KINDS)
def test_a_margin_is_kept_to_the_last_place(kind):
    """Points exactly as far apart as both margins together, far from the origin."""
    rng = np.random.default_rng(10)
    for _ in range(200):
        margin, direction = rng.uniform(1e-3, 1.0), rng.normal(size=3)
        a = 1e3 * rng.normal(size=(1, 3))
        b = a + 2.0 * margin * (1.0 - 1e-12) * direction / np.linalg.norm(direction)
        margin += 2.0**-40  # a and b are themselves rounded
        trees = [Tree(x, [[0, 0, 0]], *kind) for x in (a, b)]
        for tree, x in zip(trees, (a, b), strict=True):
            tree.refit(x, margin)
        assert len(candidates(*trees)[0]) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_degenerate_triangles_and_equal_places(kind):
    rng = np.random.default_rng(11)
    for scale in (0.0, 1e-310, 1e-160, 1.0, 1e150, 1e300):
        a = scale * rng.integers(-2, 3, (30, 3)).astype(float)
        triangles = np.vstack([np.arange(30).repeat(3).reshape(-1, 3), rng.integers(0, 30, (40, 3)), np.zeros((9, 3))])
        triangles = triangles.astype(np.int64)
        tree, other = Tree(a, triangles, *kind), Tree(a[::-1].copy(), triangles, *kind)
        assert np.array_equal(crossing_pairs(tree, other)[0], crossing([a, a[::-1].copy()], [triangles] * 2))
        assert np.array_equal(crossing_pairs(tree)[0], crossing([a], [triangles]))
        assert tree.height <= 2 * np.log2(len(triangles)) + 8 + np.log2(len(triangles))
        assert 0.0 < tree.quality <= 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_tree_without_triangles_overlaps_nothing(kind):
    empty, full = Tree(np.empty((0, 3)), np.empty((0, 3)), *kind), Tree(np.eye(3), [[0, 1, 2]], *kind)
    empty.refit(np.empty((0, 3)), 0.1)
    assert empty.quality == 1.0 and not empty.needs_rebuild
    for pair in ((empty, full), (full, empty), (empty, empty)):
        assert candidates(*pair)[0].shape == (0, 2) and crossing_pairs(*pair)[0].shape == (0, 2)
    assert self_candidates(empty)[0].shape == (0, 2) and crossing_pairs(full)[0].shape == (0, 2)


def test_obbs_stay_tight_when_their_body_turns(organ, rotation):
    points, triangles = organ
    tree = Tree(points, triangles, "obb")
    before = tree.boxes[:, 12:].copy()
    tree.refit(points @ rotation(1.3).T + 5.0)
    assert tree.boxes[:, 12:] == pytest.approx(before, rel=1e-9, abs=1e-12)


def test_degradation_is_detected_and_repaired_and_no_margin_counts(organ, rotation):
    points, triangles = organ
    tree = Tree(points, triangles)
    assert tree.quality == 1.0
    tree.refit(points @ rotation(0.5).T, 0.05)
    assert tree.quality > 0.9
    rng = np.random.default_rng(12)
    mixed = points[rng.permutation(len(points))]
    tree.refit(mixed)
    assert tree.quality < REBUILD_QUALITY and tree.needs_rebuild
    tree.rebuild(mixed)
    assert tree.quality == 1.0 and not tree.needs_rebuild
    assert np.array_equal(crossing_pairs(tree)[0], crossing([mixed], [triangles]))


def test_bad_input_is_refused_in_one_sentence(organ):
    points, triangles = organ
    bad = points.copy()
    bad[3, 1] = np.nan
    tree = Tree(points, triangles)
    for call, message in (
        (lambda: Tree(points, triangles + 9999), "nodes"),
        (lambda: Tree(points, triangles[:, :2]), "triangles of a tree are int64"),
        (lambda: Tree(points, triangles + 0.5), "whole numbers"),
        (lambda: Tree(points * 1j, triangles), "not numbers"),
        (lambda: Tree(bad, triangles), "finite"),
        (lambda: tree.refit(points[1:]), "number"),
        (lambda: tree.refit(points.ravel()), "shape"),
    ):
        with pytest.raises(InputError, match=message):
            call()
