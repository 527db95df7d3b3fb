"""Limits of motions against dense sampling: nothing intersects, and no motion is shortened needlessly."""

import numpy as np
import pytest

from palpate.bodies.particles import merge_particles
from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils
from palpate.collision.contact.proximity import SLACK, Proximity, limit, limits
from palpate.collision.triangles.closest_points import EDGE_EDGE, POINT_TRIANGLE, closest_points

NODES = np.arange(4)[None]
KEEP = 0.1


def room(kind, x, offset=0.0):
    return closest_points(np.array([kind]), NODES, x)[0][0] - offset


def limit_of(kind, x, motion, offset=0.0, keep=KEEP):
    return limit(np.array([kind]), NODES, np.array([offset]), np.zeros(1), x, motion, keep)


def motions(kind, count):
    """Make stencils, offsets, motions and whether these are wild: random, head-on, grazing, collapsed shapes.

    Wild are motions of up to 10⁵ times the distance, from 10⁻⁹ apart: their search may give up early.
    """
    rng = np.random.default_rng(10 + kind)
    for _ in range(count):
        x, motion = rng.normal(size=(2, 4, 3))
        shape, style, offset = rng.integers(4), rng.integers(5), 0.0
        if shape == 1:
            x[3], motion[3] = x[2], motion[2]
        if shape == 2:
            x[3], motion[3] = x[2] + x[1] - x[0], motion[2] + motion[1] - motion[0]
        distance, weights, normals = nearest(kind, x)
        if style in (1, 2):  # little clearance, and fast motion
            x[: kind + 1] += (10.0 ** rng.uniform(-9, -1) - distance) * normals
            motion *= 10.0 ** rng.uniform(0, 4)
        if style == 2:  # sliding past each other at nearly constant distance
            motion -= np.outer(weights, weights @ motion) / (weights @ weights)
            motion += 1e-3 * rng.normal(size=(4, 3))
        if style == 3:
            motion[: kind + 1] -= 2.5 * weights @ x + motion[: kind + 1].mean(axis=0)  # straight through
        if style == 4:
            offset = rng.uniform(0.0, 0.99) * distance
        yield x, motion, offset, style in (1, 2)


def nearest(kind, x):
    distance, weights, normals = closest_points(np.array([kind]), NODES, x)
    return distance[0], weights[0], normals[0]


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_clearance_is_kept_throughout_and_used_up_at_the_end(kind):
    ended = 0
    for x, motion, offset, wild in motions(kind, 3000):
        t, kept = limit_of(kind, x, motion, offset), KEEP * room(kind, x, offset)
        parts = np.linspace(0.0, t, 60)
        path = (x + parts[:, None, None] * motion).reshape(-1, 3)
        nodes = np.arange(len(path)).reshape(-1, 4)
        rooms = closest_points(np.full(60, kind), nodes, path)[0] - offset
        rounding = 2e-15 * (np.abs(x).max() + t * np.abs(motion).max())
        assert t > 0.0 and rooms.min() >= kept - rounding
        if t < 1.0:
            ended += 1
            assert wild or rooms[-1] <= (1.0 + SLACK) * kept + rounding
    assert ended > 800


def test_nothing_tunnels_however_fast():
    triangle = np.array([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]])
    for speed in 10.0 ** np.arange(0, 300, 20):
        for height in (1.0, 1e-6, 1e-12):
            x, motion = np.vstack([[0.0, 0.0, height], triangle]), np.zeros((4, 3))
            motion[0, 2] = -speed * 2.0
            t = limit_of(POINT_TRIANGLE, x, motion)
            assert t > 0.0
            left = height - 2.0 * speed * t
            assert KEEP * height - 1e-15 <= left <= KEEP * (1.0 + SLACK) * height + 1e-15


def test_limit_is_that_of_the_worst_stencil_and_of_radii():
    x = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]])
    kinds, nodes = np.zeros(2, int), np.array([[1, 2, 3, 4], [0, 2, 3, 4]])
    motion = np.zeros((5, 3))
    motion[:2, 2] = -4.0
    assert np.isclose(limit(kinds, nodes, np.zeros(2), np.zeros(2), x, motion, 0.1), 0.9 / 4.0, rtol=1e-12)
    assert np.isclose(limit(kinds, nodes, np.array([2.8, 0.0]), np.zeros(2), x, motion, 0.1), 0.18 / 4.0, rtol=1e-12)
    assert np.allclose(limits(kinds, nodes, np.array([2.8, 0.0]), x, motion, 0.1), [0.18 / 4.0, 0.9 / 4.0], rtol=1e-12)
    assert limit(kinds[:0], nodes[:0], np.zeros(0), np.zeros(0), x, motion, 0.1) == 1.0


def test_moving_together_or_sliding_past_is_not_limited():
    rng = np.random.default_rng(3)
    for kind in (POINT_TRIANGLE, EDGE_EDGE):
        for x in rng.normal(size=(50, 4, 3)):
            assert limit_of(kind, x, np.tile(1e6 * rng.normal(size=3), (4, 1))) == 1.0
    triangle = np.array([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]])
    slide = np.zeros((4, 3))
    slide[0, :2] = 1e6
    assert limit_of(POINT_TRIANGLE, np.vstack([[0.0, 0.0, 1e-9], triangle]), slide) == 1.0


def test_no_motion_from_touching_and_none_that_is_not_a_number():
    x = np.array([[0.0, 0.0, 1.0], [-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]])
    motion = np.zeros((4, 3))
    assert limit_of(POINT_TRIANGLE, x, motion, offset=1.0) == 0.0
    for value in (np.nan, np.inf):
        motion[0, 1] = value
        assert limit_of(POINT_TRIANGLE, x, motion) == 0.0


@pytest.mark.parametrize("kind", [0, 1])
def test_known_clearances_change_nothing(kind):
    """Bounds on the clearance, tight or loose, save work and change no result."""
    random = np.random.default_rng(5)
    for _ in range(300):
        x, motion = random.normal(size=(4, 3)), random.normal(size=(4, 3)) * random.choice([0.05, 1.0, 5.0])
        kinds, nodes, offsets = np.array([kind]), NODES, np.zeros(1)
        room = closest_points(kinds, nodes, x)[0]
        known = limit(kinds, nodes, offsets, np.zeros(1), x, motion)
        for part in (1.0, 0.5):
            assert limit(kinds, nodes, offsets, part * room, x, motion) == known


GAP, RADIUS = 0.01, 0.004


@pytest.fixture
def things(cube, cloth):
    """Make two cubes, a sheet that can touch itself, and a rod: points, surfaces, thicknesses, pairs that can touch."""
    bodies = merge_particles([cube(1)] * 2, [[0, 0, 0], [0.02, 0.01, 0.108]], "two")
    sheet = cloth(2)
    rod = np.array([[0.15, 0.0, 0.0], [0.15, 0.1, 0.12]])
    points = np.vstack([bodies.nodes, sheet.nodes - [0.0, 0.0, 0.008], rod])
    n, m = len(bodies.nodes), len(bodies.triangles) // 2
    surfaces = [
        bodies.triangles[:m],
        bodies.triangles[m:],
        sheet.triangles + n,
        np.array([[0, 1, 1]]) + len(points) - 2,
    ]
    can_touch = ~np.eye(4, dtype=bool)
    can_touch[2, 2] = True
    return points, surfaces, np.array([0.0, 0.0, 0.0, RADIUS]), can_touch


def search(things):
    points, surfaces, radii, can_touch = things
    return Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)


def near_by_force(points, surfaces, radii, can_touch, within):
    found = set()
    for i, j in np.argwhere(np.triu(can_touch)):
        pairs = np.argwhere(np.ones((len(surfaces[i]), len(surfaces[j]))))
        if i == j:
            pairs = np.vstack([pairs[pairs[:, 0] < pairs[:, 1]], adjacent_pairs(surfaces[i])])
        kinds, nodes = stencils(Surface(surfaces[i]), Surface(surfaces[j]), pairs)
        near = closest_points(kinds, nodes, points)[0] - radii[i] - radii[j] < within
        found |= {(int(k), *map(int, row)) for k, row in zip(kinds[near], nodes[near], strict=True)}
    return found


def found_by(proximity, points, way=0.0):
    near = proximity.find_near(points, way)
    kept = near.clearances(points) < GAP + 2.0 * way
    return {(int(k), *map(int, row)) for k, row in zip(near.kinds[kept], near.nodes[kept], strict=True)}


@pytest.mark.parametrize("pace", [1e-4, 1e-3, 1e-2, 0.1])
def test_what_is_found_equals_brute_force_along_a_walk(things, pace):
    (points, surfaces, radii, can_touch), proximity = things, search(things)
    rng, x = np.random.default_rng(1), points.copy()
    drift, some = rng.normal(size=points.shape), 0
    for _ in range(40):
        x = x + pace * np.clip(drift + rng.normal(size=x.shape), -1.0, 1.0) * 0.5
        expected = near_by_force(x, surfaces, radii, can_touch, GAP)
        assert found_by(proximity, x) == expected
        assert found_by(proximity, x, pace) == near_by_force(x, surfaces, radii, can_touch, GAP + 2.0 * pace)
        some += len(expected)
    assert some


def test_nothing_that_could_touch_during_the_motion_is_missed(things):
    points, proximity, everything = things[0], search(things), search(things).find_near(things[0], 10.0)
    rng = np.random.default_rng(2)
    for size in np.geomspace(1e-3, 0.3, 60):
        way = size * np.clip(rng.normal(size=points.shape), -2.0, 2.0)
        longest = np.linalg.norm(way, axis=1).max()
        assert proximity.find_near(points, longest).limit(points, way) == everything.limit(points, way)


def test_a_search_serves_while_nothing_has_come_near(things):
    points, proximity, searches = things[0], search(things), []
    anew = proximity._search
    proximity._search = lambda x: searches.append(1) or anew(x)
    for step in range(11):
        proximity.find_near(points + 0.09 * step * GAP / np.sqrt(3.0), 0.0)
    assert len(searches) == 1
    proximity.find_near(points + 2.0 * GAP, 0.0)
    assert len(searches) == 2


def test_pieces_and_offsets_belong_to_the_parts(things):
    points, surfaces, radii, _ = things
    near = search(things).find_near(points, 0.1)
    owner = np.concatenate([np.full(len(np.unique(s)), i) for i, s in enumerate(surfaces)])
    assert np.array_equal(near.pieces, owner[near.nodes[:, [0, 3]]])
    assert near.offsets == pytest.approx(radii[near.pieces].sum(axis=1))
    assert (np.sort(near.pieces[near.pieces[:, 0] == near.pieces[:, 1]], axis=1) == 2).all()


def test_points_that_cannot_move_are_not_searched(things):
    points, proximity = things[0], search(things)
    proximity.movable[:] = False
    assert not len(proximity.find_near(points, 1.0).kinds)
    proximity = search(things)
    proximity.movable[1:] = False
    assert (proximity.find_near(points, 1.0).nodes == 0).any(axis=1).all()
