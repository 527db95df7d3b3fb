"""Bounding volumes at the roots of trees: they contain their points, and overlap when they must."""

import numpy as np
import pytest
from scipy.optimize import linprog

from palpate.collision.trees.tree_query import StoppedTree, volume_pairs
from palpate.collision.trees.volumes import DIRECTIONS, KINDS, OBB, volumes_overlap


def fit(kind, points):
    """Return a tree of one volume around points."""
    return StoppedTree(points, np.repeat(np.arange(len(points)), 3).reshape(-1, 3), 0, kind)


def row_of(kind, tree):
    return (tree.spheres if kind == "sphere" else tree.boxes)[0]


def overlap(a, b):
    return len(volume_pairs(a, b)[0]) > 0


def contains(kind, row, points):
    """Test whether all points are inside, to within rounding of this check."""
    slack = 1e-12 * (1e-300 + np.abs(points).max())
    if kind == "sphere":
        return (np.linalg.norm(points - row[:3], axis=1) <= row[3] + slack).all()
    if kind == "obb":
        return (np.abs((points - row[:3]) @ row[3:12].reshape(3, 3).T) <= row[12:] + slack).all()
    along = points @ DIRECTIONS[kind].T
    low, high = np.split(row, 2)
    return (along >= low - slack).all() and (along <= high + slack).all()


def clouds(rng):
    """Make points in general, in a plane, on a line, alone, far away, tiny, and of no extent in one direction."""
    cloud = rng.normal(size=(20, 3)) * [1.0, 0.3, 0.1]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    yield from (cloud, cloud @ turn, cloud * [1, 1, 0] @ turn, cloud * [1, 0, 0] @ turn, cloud[:1], cloud[:3])
    yield from (cloud + 1e6, 1e-200 * cloud, 1e-310 * cloud, 1e150 * cloud, np.tile(cloud[:1], (4, 1)))


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_contain_their_points_when_fitted_and_refitted(kind):
    rng = np.random.default_rng(0)
    for points in clouds(rng):
        tree = fit(kind, points)
        assert np.isfinite(row_of(kind, tree)).all() and contains(kind, row_of(kind, tree), points)
        moved = points[::-1] * rng.normal(size=3)
        tree.refit(moved)
        assert np.isfinite(row_of(kind, tree)).all() and contains(kind, row_of(kind, tree), moved)


def hulls_meet(a, b):
    """Test whether two convex hulls have a common point, by linear programming."""
    n, m = len(a), len(b)
    equal = np.zeros((5, n + m))
    equal[:3], equal[3, :n], equal[4, n:] = np.vstack([a, -b]).T, 1.0, 1.0
    return linprog(np.zeros(n + m), A_eq=equal, b_eq=[0, 0, 0, 1, 1]).success


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_overlap_wherever_their_points_hulls_do(kind):
    rng = np.random.default_rng(1)
    answers = []
    for _ in range(150):
        a, b = (rng.normal(size=(3, 3)) + 1.5 * rng.normal(size=3) for _ in range(2))
        answers.append((hulls_meet(a, b), overlap(fit(kind, a), fit(kind, b))))
        assert answers[-1][1] == overlap(fit(kind, b), fit(kind, a))
    must, does = np.array(answers).T
    assert must.any() and not does.all() and does[must].all()


@pytest.mark.parametrize("kind", KINDS)
def test_points_that_touch_overlap_whatever_the_rounding_and_far_ones_do_not(kind):
    rng = np.random.default_rng(2)
    for scale in (1e-300, 1e-150, 1.0, 1e150):
        for _ in range(200):
            shared = scale * rng.normal(size=3)
            # the last point lies on a triangle, and at the tip of the other
            a, b = np.array([shared, *(scale * rng.normal(size=(2, 3)))]), scale * rng.normal(size=(3, 3))
            b[0] = shared
            assert overlap(fit(kind, a), fit(kind, b))
            assert overlap(fit(kind, a), fit(kind, shared[None]))
    points = rng.uniform(-1, 1, (10, 3))
    for axis in range(3):
        assert not overlap(fit(kind, points), fit(kind, points + 4.0 * np.eye(3)[axis]))


def test_boxes_overlap_exactly_where_exact_boxes_do():
    """OBBs at random angles, against linear programming over their eight corners."""
    rng = np.random.default_rng(4)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    none, answers = np.empty((0, 4)), []
    for _ in range(300):
        rows, corners = [], []
        for _ in range(2):
            axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            centre, half = 1.2 * rng.normal(size=3), rng.uniform(0.1, 1.5, 3)
            rows.append(np.concatenate([centre, axes.ravel(), half])[None])
            corners.append(centre + (signs * half) @ axes)
        answers.append((hulls_meet(*corners), volumes_overlap(OBB, OBB, none, none, *rows, 0, 0)))
    exact, ours = np.array(answers).T
    assert 60 < exact.sum() < 240
    assert np.array_equal(exact, ours)


def test_volumes_are_as_tight_as_known(rotation):
    cube = np.array(np.meshgrid([0.0, 2], [0.0, 2], [0.0, 2])).reshape(3, 8).T
    assert fit("aabb", cube).boxes[0].tolist() == [0, 0, 0, 2, 2, 2]
    assert fit("obb", cube).boxes[0, 12:] == pytest.approx([1, 1, 1], rel=1e-11)
    assert fit("sphere", cube).spheres[0] == pytest.approx([1, 1, 1, np.sqrt(3)], rel=1e-12)
    points = np.random.default_rng(6).uniform(-1, 1, (200, 3)) * [1.0, 0.2, 0.05] @ rotation(0.7).T
    for kind, normals in DIRECTIONS.items():
        along = points @ normals.T
        assert fit(kind, points).boxes[0] == pytest.approx([*along.min(axis=0), *along.max(axis=0)], rel=1e-12)
    # an OBB follows points that are long in one direction
    assert 8.0 * fit("obb", points).boxes[0, 12:].prod() < 0.3 * np.ptp(points, axis=0).prod()
