"""The search without a tree finds what trying all pairs finds."""

from fractions import Fraction

import numpy as np
import pytest

from palpate.collision.triangles.intersection import triangle_pairs_intersect
from palpate.studies.brute_force import crossing, overlapping
from palpate.studies.prescribed_motions import folding_sheet, random_soup, two_livers

SCENES = [two_livers(0), folding_sheet(10), random_soup(80, seed=3)]


def every_pair(points, triangles):
    """All pairs of two bodies, or all i < j of one."""
    count, other = len(triangles[0]), len(triangles[-1])
    pairs = np.argwhere(np.ones((count, other), bool))
    return pairs[pairs[:, 0] < pairs[:, 1]] if len(triangles) == 1 else pairs


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
@pytest.mark.parametrize("time", [0.0, 0.4, 0.8])
def test_pairs_whose_boxes_meet_and_pairs_that_cross_are_all_found(scene, time):
    points, cells = scene.at(time), scene.triangles
    pairs = every_pair(points, cells)
    one, other = points[0][cells[0]][pairs[:, 0]], points[-1][cells[-1]][pairs[:, 1]]
    meet = (one.min(axis=1) <= other.max(axis=1)).all(axis=1) & (other.min(axis=1) <= one.max(axis=1)).all(axis=1)
    assert np.array_equal(overlapping(points, cells), pairs[meet])
    cross = triangle_pairs_intersect(one, other)
    if len(cells) == 1:
        cross &= [not set(cells[0][i]) & set(cells[0][j]) for i, j in pairs]
    assert cross.any() or time < 0.8
    assert np.array_equal(crossing(points, cells), pairs[cross])


def test_boxes_that_touch_at_one_coordinate_count():
    third = float(Fraction(1, 3))
    corners = np.array([[0, 0, 0], [third, 0, 0], [0, third, 0]])
    shifted = corners + np.array([third, 0, 0])
    triangle = np.array([[0, 1, 2]])
    assert overlapping([corners, shifted], [triangle, triangle]).tolist() == [[0, 0]]
    beyond = shifted + np.array([np.spacing(third), 0, 0])
    assert overlapping([corners, beyond], [triangle, triangle]).tolist() == []
