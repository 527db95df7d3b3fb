"""The overlap of two volumes: pushed out by its depth they touch, pushed less they still overlap."""

import numpy as np
import pytest

from palpate.collision.trees.tree_query import StoppedTree, overlaps, volume_pairs
from palpate.errors import InputError

CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
ROOT = np.zeros((1, 2), dtype=np.int64)
STRUCTURES = {"sphere": "sphere", "aabb": "aabb", "both": "composite"}


def tree(points, structure):
    return StoppedTree(points, FACES, 0, STRUCTURES[structure], (0, 1))


def overlapping(one, points, other, shift):
    one.refit(points + shift)
    return len(volume_pairs(one, other)[0]) > 0


@pytest.mark.parametrize("first", STRUCTURES)
@pytest.mark.parametrize("second", STRUCTURES)
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


def test_spheres_in_closed_form():
    one, other = tree(CORNER, "sphere"), tree(CORNER + np.array([1.0, 0.0, 0.0]), "sphere")
    (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
    # about the middle of the box, through the corners
    assert depth == pytest.approx(np.sqrt(3.0) - 1.0, rel=1e-12)
    assert direction == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)
    assert place == pytest.approx([1.0, 0.5, 0.5], abs=1e-12)


def test_boxes_in_closed_form():
    one, other = tree(CORNER, "aabb"), tree(CORNER + np.array([0.2, -0.1, 0.7]), "aabb")
    (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
    assert depth == pytest.approx(0.3, rel=1e-12)
    assert direction == pytest.approx([0.0, 0.0, -1.0], abs=0.0)
    assert place == pytest.approx([0.6, 0.45, 0.85], rel=1e-12)


def test_a_sphere_over_a_box_in_closed_form():
    # radius √3/2 about (0.5, 0.5, 1.7), over a box that ends at z = 1
    one, other = tree(CORNER + np.array([0.0, 0.0, 1.2]), "sphere"), tree(CORNER, "aabb")
    (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
    assert depth == pytest.approx(np.sqrt(0.75) - 0.7, rel=1e-12)
    assert direction == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert place == pytest.approx([0.5, 0.5, 1.0 - depth / 2], rel=1e-12)


def test_one_sphere_in_another_of_the_same_centre():
    one, other = tree(CORNER, "sphere"), tree(0.5 * CORNER + 0.25, "sphere")
    (place,), (direction,), (depth,) = overlaps(one, other, ROOT)
    assert depth == pytest.approx(1.5 * np.sqrt(0.75), rel=1e-12)
    assert np.linalg.norm(direction) == 1.0 and place == pytest.approx([0.5, 0.5, 0.5], abs=1e-12)


def test_other_volumes_give_no_contacts():
    one = StoppedTree(CORNER, FACES, 0, "obb")
    with pytest.raises(InputError, match="make it of sphere, aabb or composite"):
        overlaps(one, one, ROOT)
