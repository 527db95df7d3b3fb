"""Distance and overlap of surfaces against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.bodies.surfaces.even_triangulation import fibonacci_sphere, triangulate
from palpate.collision.trees.tree import Tree
from palpate.studies.collision.stopped_precision import distance, overlap

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
    [1, 5, 7], [1, 7, 3],
])  # fmt: skip


def ball(count, radius, centre):
    sphere = fibonacci_sphere(count)
    return radius * sphere + centre, triangulate(sphere)


def test_distance_of_turned_cubes_whose_faces_look_at_each_other():
    for seed in range(5):
        turn = Rotation.random(random_state=np.random.default_rng(seed))
        # far from any node: the nearest nodes are 0.5 apart, the faces 0.01
        one, other = CORNERS * [1, 4, 4], CORNERS + np.array([1.01, 1.5, 1.5])
        points = [turn.apply(one), turn.apply(other)]
        trees = [Tree(at, FACES, "sphere") for at in points]
        assert distance(points, trees) == pytest.approx(0.01, rel=1e-9)
        assert distance([points[0], points[1] + turn.apply([-0.1, 0.0, 0.0])], trees) == 0.0


def test_the_overlap_of_two_balls_is_a_lens():
    # radii 1 and 0.6, centres 1.4 apart along a tilted axis: 0.2 deep
    way = np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5])
    (a, one), (b, other) = ball(2500, 1.0, np.zeros(3)), ball(2500, 0.6, 1.4 * way)
    velocities = [np.tile([1.0, 0.0, 0.0], (len(a), 1)), np.tile([0.0, 3.0, 0.0], (len(b), 1))]
    found = overlap([a, b], velocities, [one, other])
    assert found.depth == pytest.approx(0.2, rel=0.02)
    # a has to move away from b
    assert found.direction == pytest.approx(-way, abs=0.01)
    assert found.place @ way == pytest.approx(0.9, abs=0.02)
    assert np.linalg.norm(found.place - found.place @ way * way) < 0.01
    assert found.velocity.tolist() == [1.0, -3.0, 0.0]
    back = overlap([b, a], velocities[::-1], [other, one])
    assert back.depth == pytest.approx(found.depth, rel=1e-6)
    assert back.direction == pytest.approx(-found.direction, abs=1e-6)


def test_bodies_apart_have_no_overlap():
    (a, one), (b, other) = ball(300, 1.0, np.zeros(3)), ball(300, 0.6, [1.7, 0.0, 0.0])
    assert overlap([a, b], [np.zeros_like(a), np.zeros_like(b)], [one, other]) is None


def test_a_body_that_is_wholly_inside_another_overlaps():
    (a, one), (b, other) = ball(800, 1.0, np.zeros(3)), ball(300, 0.2, [0.7, 0.0, 0.0])
    found = overlap([a, b], [np.zeros_like(a), np.zeros_like(b)], [one, other])
    # the far side of the small ball is half way in
    assert found.depth == pytest.approx(0.5, rel=0.03)
    assert found.direction == pytest.approx([-1.0, 0.0, 0.0], abs=0.1)
