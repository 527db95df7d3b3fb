"""Bounding volumes: they contain their points, overlap when they must, and are as tight as computed."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from palpate.collision.trees.volumes import DIRECTIONS, KINDS, fit, overlap, refit, tightness, volume
from palpate.errors import InputError


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
        row = fit(kind, points)
        assert np.isfinite(row).all() and contains(kind, row, points)
        moved = np.vstack([points, points[::-1]]) * rng.normal(size=3)
        refit(kind, row, moved)
        assert np.isfinite(row).all() and contains(kind, row, moved)


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
        answers.append((hulls_meet(a, b), overlap(kind, fit(kind, a), fit(kind, b))))
        assert answers[-1][1] == overlap(kind, fit(kind, b), fit(kind, a))
    must, does = np.array(answers).T
    assert must.any() and not does.all() and does[must].all()


@pytest.mark.parametrize("kind", KINDS)
def test_points_that_touch_overlap_whatever_the_rounding(kind):
    rng = np.random.default_rng(2)
    for scale in (1e-300, 1e-150, 1.0, 1e150):
        for _ in range(200):
            shared = scale * rng.normal(size=3)
            # the last point lies on a triangle, and at the tip of the other
            a, b = np.array([shared, *(scale * rng.normal(size=(2, 3)))]), scale * rng.normal(size=(3, 3))
            b[0] = shared
            assert overlap(kind, fit(kind, a), fit(kind, b))
            assert overlap(kind, fit(kind, a), fit(kind, shared[None]))


@pytest.mark.parametrize("kind", ["sphere", "obb", "aabb"])
def test_volumes_far_apart_do_not_overlap(kind):
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (10, 3))
    for axis in range(3):
        assert not overlap(kind, fit(kind, points), fit(kind, points + 4.0 * np.eye(3)[axis]))


def test_boxes_overlap_exactly_where_exact_boxes_do():
    """OBBs at random angles, against linear programming over their eight corners."""
    rng = np.random.default_rng(4)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    answers = []
    for _ in range(300):
        rows, corners = [], []
        for _ in range(2):
            axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            centre, half = 1.2 * rng.normal(size=3), rng.uniform(0.1, 1.5, 3)
            rows.append(np.concatenate([centre, axes.ravel(), half]))
            corners.append(centre + (signs * half) @ axes)
        answers.append((hulls_meet(*corners), overlap("obb", *rows)))
    exact, ours = np.array(answers).T
    assert 60 < exact.sum() < 240
    assert np.array_equal(exact, ours)


def test_volumes_are_known_ones():
    cube = np.array(np.meshgrid([0.0, 2], [0.0, 2], [0.0, 2])).reshape(3, 8).T
    assert volume("aabb", fit("aabb", cube)) == 8.0
    assert volume("obb", fit("obb", cube)) == pytest.approx(8.0, rel=1e-11)
    assert volume("sphere", fit("sphere", cube)) == pytest.approx(4 / 3 * np.pi * 3**1.5, rel=1e-12)
    # an octahedron is a 14-DOP, a rhombic dodecahedron an 18-DOP
    octahedron = np.vstack([np.eye(3), -np.eye(3)])
    assert tightness("dop14", octahedron) == pytest.approx(1.0, rel=1e-9)
    dodecahedron = np.vstack([cube - 1.0, 2 * octahedron])
    assert tightness("dop18", dodecahedron) == pytest.approx(1.0, rel=1e-9)
    assert tightness("aabb", octahedron) == pytest.approx(6.0, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_no_volume_is_smaller_than_the_hull(kind):
    rng = np.random.default_rng(5)
    for _ in range(20):
        points = rng.normal(size=(12, 3)) * rng.uniform(0.05, 1.0, 3)
        assert tightness(kind, points) >= 1.0 - 1e-9
    assert tightness(kind, np.zeros((5, 3))) == tightness(kind, rng.normal(size=(3, 3))) == np.inf


def test_obbs_follow_points_that_are_long_in_one_direction(rotation):
    points = np.random.default_rng(6).uniform(-1, 1, (200, 3)) * [1.0, 0.2, 0.05] @ rotation(0.7).T
    assert volume("obb", fit("obb", points)) < 0.3 * volume("aabb", fit("aabb", points))
    assert volume("dop14", fit("dop14", points)) < volume("aabb", fit("aabb", points))
    assert ConvexHull(points).volume > 0.0


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.full((2, 3), np.nan), np.zeros(3)])
def test_bad_points_are_refused(points):
    with pytest.raises(InputError, match="finite"):
        fit("aabb", points)


def test_unknown_volumes_are_refused():
    with pytest.raises(InputError, match="unknown"):
        fit("ellipsoid", np.zeros((1, 3)))
