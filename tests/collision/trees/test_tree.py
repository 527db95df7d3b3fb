"""Trees: the pairs they find against all pairs, in hundreds of frames, for every structure; degradation; bad input."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palpate.bodies.organs import liver
from palpate.collision.trees.tree import REBUILD_QUALITY, STRUCTURES, Tree
from palpate.collision.trees.tree_query import candidates, crossing_pairs, self_candidates
from palpate.collision.triangles.intersection import pairs_intersect
from palpate.errors import InputError

FRAMES = 200
EXTREMES = (np.min, np.max)
KINDS = [(name, (3, 2)) for name in STRUCTURES]
KINDS += [("composite", depths) for depths in ((0, 0), (0, 4), (4, 0), (2, 20), (30, 0))]


def all_pairs(a, triangles_a, b=None, triangles_b=None):
    """Find all pairs of triangles that intersect, sorted: those whose boxes overlap, then the exact test."""
    alone = b is None
    b, triangles_b = (a, triangles_a) if alone else (b, triangles_b)
    low_a, high_a, low_b, high_b = (f(p[t], axis=1) for p, t in ((a, triangles_a), (b, triangles_b)) for f in EXTREMES)
    near = ((low_a[:, None] <= high_b) & (low_b <= high_a[:, None])).all(axis=2)
    if alone:
        shared = (triangles_a[:, None, :, None] == triangles_a[None, :, None, :]).any(axis=(2, 3))
        near &= ~shared & np.triu(np.ones_like(near), 1)
    pairs = np.argwhere(near)
    return pairs[pairs_intersect(a, triangles_a, b, triangles_b, pairs)]


def ball(count):
    """Make points and triangles of a bumpy ball, by its convex hull."""
    points = np.random.default_rng(7).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return points, ConvexHull(points).simplices.astype(np.int64)


def grid(n):
    """Make points (n², 3) of a unit square and its triangles."""
    points = np.stack(np.meshgrid(np.arange(n), np.arange(n), [0], indexing="ij"), axis=-1).reshape(-1, 3) / (n - 1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return points, np.vstack([corner[:, None] + [0, n, n + 1], corner[:, None] + [0, n + 1, 1]])


@pytest.fixture(scope="module")
def organ():
    mesh = liver(0.2)
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    return mesh.nodes[used], triangles.reshape(-1, 3)


def two_livers(organ):
    points, triangles = organ
    for s in np.linspace(0.0, 1.0, FRAMES):
        a = points * (1.0 + 0.08 * np.sin(2 * np.pi * s + 40.0 * points[:, [1, 2, 0]]))
        c, d = np.cos(3.0 * s), np.sin(3.0 * s)
        b = points @ np.array([[c, -d, 0], [d, c, 0], [0, 0, 1]]) + [0.0, 0.1 - 0.05 * np.sin(6 * s), 0.02]
        yield a, triangles, b, triangles


def instrument(organ):
    """Move a small ball through the liver, which gives way around it."""
    points, triangles = organ
    tool, faces = ball(60)
    for s in np.linspace(0.0, 1.0, FRAMES):
        centre = np.array([0.02, 0.0, 0.08 - 0.12 * s])
        away = points - centre
        pressed = points + 0.01 * away * np.exp(-((np.linalg.norm(away, axis=1) / 0.03) ** 2))[:, None]
        yield pressed, triangles, centre + 0.015 * tool, faces


def soup(_):
    """Make triangles without common nodes, some degenerate, at new places in every frame."""
    rng = np.random.default_rng(8)
    for _ in range(FRAMES):
        clouds = []
        for _ in range(2):
            points = rng.uniform(-1, 1, (150, 1, 3)) + 0.15 * rng.normal(size=(150, 3, 3))
            points[:5], points[5:10, 2] = points[:5, :1], points[5:10, 1]
            clouds += [points.reshape(-1, 3), np.arange(450).reshape(-1, 3)]
        clouds[2][:30] = clouds[0][:30]  # some share single points only
        yield clouds


@pytest.mark.parametrize("scene", [two_livers, instrument, soup])
def test_pairs_of_two_bodies_are_all_pairs_in_every_frame(scene, organ):
    trees, total = None, 0
    for a, triangles_a, b, triangles_b in scene(organ):
        trees = trees or [[Tree(p, t, *kind) for p, t in ((a, triangles_a), (b, triangles_b))] for kind in KINDS]
        expected = all_pairs(a, triangles_a, b, triangles_b)
        total += len(expected)
        for one, other in trees:
            one.refit(a)
            other.refit(b)
            pairs, counts = crossing_pairs(one, other)
            assert np.array_equal(pairs, expected), (one.structure, one.depths)
            assert counts.node_tests <= 4 * len(triangles_a) * len(triangles_b)
            assert len(pairs) <= counts.triangle_tests
    assert total > 5 * FRAMES


def test_a_folding_sheet_finds_itself_in_every_frame():
    points, triangles = grid(9)
    trees = [Tree(points, triangles, *kind) for kind in KINDS]
    found = []
    for s in np.linspace(0.01, 1.0, FRAMES):
        angle, radius = 11.0 * s * points[:, 0], 0.1 * (1.0 + 0.3 * np.sin(7.0 * points[:, 1] + 5.0 * points[:, 0]))
        x = np.column_stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)]) / s
        expected = all_pairs(x, triangles)
        found.append(len(expected))
        for tree in trees:
            tree.refit(x)
            pairs, _ = crossing_pairs(tree)
            assert np.array_equal(pairs, expected), (tree.structure, tree.depths)
    assert found[0] == 0 and max(found) > 20


def test_structures_with_spheres_and_boxes_can_be_mixed(organ):
    points, triangles = organ
    moved = np.add(points, [0.01, 0.06, 0.02])
    expected = all_pairs(points, triangles, moved, triangles)
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


def test_composites_without_spheres_or_boxes_are_the_pure_trees(organ):
    """The same code must do the same tests of the same volumes."""
    points, triangles = organ
    moved = np.add(points, [0.01, 0.06, 0.02])

    def search(*kind):
        pairs, tests = candidates(Tree(points, triangles, *kind), Tree(moved, triangles, *kind))
        return pairs.tolist(), tests

    assert search("composite", (0, 0)) == search("aabb")
    assert search("composite", (99, 0)) == search("sphere")
    assert len(search("aabb")[0]) < len(search("composite", (99, 0))[0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("margin", [0.0, 0.03])
def test_swept_and_inflated_trees_miss_nothing_on_the_path(kind, margin):
    rng = np.random.default_rng(9)
    triangles = np.arange(120).reshape(-1, 3)
    starts = [np.repeat(rng.uniform(-1, 1, (40, 3)), 3, axis=0) + 0.1 * rng.normal(size=(120, 3)) for _ in range(2)]
    ends = [x + 0.3 * rng.normal(size=(1, 3)) + 0.1 * rng.normal(size=(120, 3)) for x in starts]
    trees = [Tree(x, triangles, *kind) for x in starts]
    for tree, start, end in zip(trees, starts, ends, strict=True):
        tree.refit(start, margin, end)
    found = {tuple(pair) for pair in candidates(*trees)[0]}
    weights = rng.dirichlet([0.5] * 3, 12)
    near = set()
    for s in np.linspace(0.0, 1.0, 21):
        now = [(1 - s) * start + s * end for start, end in zip(starts, ends, strict=True)]
        near |= {tuple(pair) for pair in all_pairs(now[0], triangles, now[1], triangles)}
        if margin:
            a, b = (np.einsum("kc,tci->tki", weights, x[triangles]) for x in now)
            apart = np.linalg.norm(a[:, None, :, None] - b[None, :, None, :], axis=-1).min(axis=(2, 3))
            near |= {tuple(pair) for pair in np.argwhere(apart <= 2 * margin)}
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
@pytest.mark.parametrize("split", ["sah", "median"])
def test_degenerate_triangles_and_equal_places(kind, split):
    rng = np.random.default_rng(11)
    for scale in (0.0, 1e-310, 1e-160, 1.0, 1e150, 1e300):
        a = scale * rng.integers(-2, 3, (30, 3)).astype(float)
        triangles = np.vstack([np.arange(30).repeat(3).reshape(-1, 3), rng.integers(0, 30, (40, 3)), np.zeros((9, 3))])
        triangles = triangles.astype(np.int64)
        tree, other = Tree(a, triangles, *kind, split), Tree(a[::-1].copy(), triangles, *kind, split)
        assert np.array_equal(crossing_pairs(tree, other)[0], all_pairs(a, triangles, a[::-1].copy(), triangles))
        assert np.array_equal(crossing_pairs(tree)[0], all_pairs(a, triangles))
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


@pytest.mark.parametrize("split", ["sah", "median"])
def test_every_triangle_is_in_one_leaf_and_siblings_come_before_their_children(organ, split):
    tree = Tree(*organ, split=split)
    assert np.array_equal(np.sort(tree.order), np.arange(len(tree.triangles)))
    child, first, last, _ = tree.nodes.T
    inner = np.flatnonzero(child >= 0)
    assert (child[inner] > inner).all()
    assert np.array_equal(np.sort(np.concatenate([child[inner], child[inner] + 1])), np.arange(1, len(tree.nodes)))
    assert np.array_equal(first[child[inner]], first[inner]) and np.array_equal(last[child[inner] + 1], last[inner])
    assert np.array_equal(last[child[inner]], first[child[inner] + 1])


def test_obbs_stay_tight_when_their_body_turns(organ, rotation):
    points, triangles = organ
    tree = Tree(points, triangles, "obb")
    before = tree.boxes[:, 12:].copy()
    tree.refit(points @ rotation(1.3).T + 5.0)
    assert tree.boxes[:, 12:] == pytest.approx(before, rel=1e-9, abs=1e-12)


def test_degradation_is_detected_and_repaired_and_neither_margin_nor_path_counts(organ, rotation):
    points, triangles = organ
    tree = Tree(points, triangles)
    assert tree.quality == 1.0
    tree.refit(points @ rotation(0.5).T, 0.05, points + 1.0)
    assert tree.quality > 0.9
    rng = np.random.default_rng(12)
    mixed = points[rng.permutation(len(points))]
    tree.refit(mixed)
    assert tree.quality < REBUILD_QUALITY and tree.needs_rebuild
    tree.rebuild(mixed)
    assert tree.quality == 1.0 and not tree.needs_rebuild
    assert np.array_equal(crossing_pairs(tree)[0], all_pairs(mixed, triangles))


def test_the_same_tree_is_built_twice(organ):
    one, other = Tree(*organ), Tree(*organ)
    assert np.array_equal(one.nodes, other.nodes) and np.array_equal(one.order, other.order)
    assert np.array_equal(one.boxes, other.boxes)


def test_bad_input_is_refused_in_one_sentence(organ):
    points, triangles = organ
    bad = points.copy()
    bad[3, 1] = np.nan
    tree = Tree(points, triangles)
    for call, message in (
        (lambda: Tree(points, triangles, "cube"), "structure"),
        (lambda: Tree(points, triangles, split="best"), "split"),
        (lambda: Tree(points, triangles, depths=(-1, 2)), "depths"),
        (lambda: Tree(points, triangles, depths=3), "depths"),
        (lambda: Tree(points, triangles, depths=(1.5, 2)), "depths"),
        (lambda: Tree(points, triangles, depths=((1, 2), 3)), "depths"),
        (lambda: Tree(points, triangles + 9999), "nodes"),
        (lambda: Tree(points, triangles[:, :2]), "triangles of a tree have shape"),
        (lambda: Tree(points, triangles.ravel()), "triangles of a tree have shape"),
        (lambda: Tree(points, triangles + 0.5), "whole numbers"),
        (lambda: Tree(points.astype(str), triangles), "not numbers"),
        (lambda: Tree(points * 1j, triangles), "not numbers"),
        (lambda: Tree([[0.0, 0.0, 0.0], [1.0]], triangles), "not numbers"),
        (lambda: Tree(None, triangles), "not numbers"),
        (lambda: crossing_pairs(tree, triangles), "make a Tree"),
        (lambda: Tree(bad, triangles), "finite"),
        (lambda: tree.refit(points[1:]), "number"),
        (lambda: tree.refit(points, -1.0), "margin"),
        (lambda: tree.refit(points, 0.0, bad), "finite"),
        (lambda: tree.refit(points.ravel()), "shape"),
    ):
        with pytest.raises(InputError, match=message):
            call()
