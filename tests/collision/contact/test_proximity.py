"""A search's stored result gives the same stencils later as brute force."""

import numpy as np
import pytest

from palpate.bodies.particles import merge_particles
from palpate.collision.contact.barrier import Surface, adjacent_pairs, stencils
from palpate.collision.contact.proximity import Proximity
from palpate.collision.triangles.closest_points import closest_points

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


def near_by_force(points, surfaces, radii, can_touch, within):
    found = set()
    for i, j in np.argwhere(np.triu(can_touch)):
        pairs = np.stack(np.meshgrid(range(len(surfaces[i])), range(len(surfaces[j])), indexing="ij"), -1).reshape(
            -1, 2
        )
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
    points, surfaces, radii, can_touch = things
    proximity = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
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
    points, surfaces, radii, can_touch = things
    proximity = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
    everything = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
    everything = everything.find_near(points, 10.0)
    rng = np.random.default_rng(2)
    for size in np.geomspace(1e-3, 0.3, 60):
        way = size * np.clip(rng.normal(size=points.shape), -2.0, 2.0)
        longest = np.linalg.norm(way, axis=1).max()
        assert proximity.find_near(points, longest).limit(points, way) == everything.limit(points, way)


def test_a_search_serves_while_nothing_has_come_near(things):
    points, surfaces, radii, can_touch = things
    proximity = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
    searches, search = [], proximity._search
    proximity._search = lambda x: searches.append(1) or search(x)
    for step in range(11):
        proximity.find_near(points + 0.09 * step * GAP / np.sqrt(3.0), 0.0)
    assert len(searches) == 1
    proximity.find_near(points + 2.0 * GAP, 0.0)
    assert len(searches) == 2


def test_pieces_and_offsets_belong_to_the_parts(things):
    points, surfaces, radii, can_touch = things
    near = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP).find_near(points, 0.1)
    owner = np.concatenate([np.full(len(np.unique(s)), i) for i, s in enumerate(surfaces)])
    assert np.array_equal(near.pieces, owner[near.nodes[:, [0, 3]]])
    assert near.offsets == pytest.approx(radii[near.pieces].sum(axis=1))
    assert (np.sort(near.pieces[near.pieces[:, 0] == near.pieces[:, 1]], axis=1) == 2).all()


def test_points_that_cannot_move_are_not_searched(things):
    points, surfaces, radii, can_touch = things
    proximity = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
    proximity.movable[:] = False
    assert not len(proximity.find_near(points, 1.0).kinds)
    proximity = Proximity(points, surfaces, radii, can_touch, np.ones(len(points)), GAP)
    proximity.movable[1:] = False
    assert (proximity.find_near(points, 1.0).nodes == 0).any(axis=1).all()
