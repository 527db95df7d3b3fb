"""The bodies of scenes deform but the instrument; soups and waves are as they are asked for."""

import numpy as np
import pytest

from palpate.studies.brute_force import crossing
from palpate.studies.prescribed_motions import SOUP_GRID, crossing_waves, scenes


@pytest.fixture(scope="module")
def small():
    return {scene.name: scene for scene in scenes(0, seed=1)}


@pytest.mark.parametrize("name", ["two_livers", "instrument_press", "folding_sheet"])
def test_bodies_deform_but_the_instrument_does_not(small, name):
    scene = small[name]
    for body, triangles in enumerate(scene.triangles):
        lengths = [np.linalg.norm(np.diff(scene.at(t)[body][triangles[:, :2]], axis=1), axis=2) for t in (0.2, 0.6)]
        changed = np.abs(lengths[1] - lengths[0]).max()
        assert changed < 1e-12 if (name, body) == ("instrument_press", 0) else changed > 1e-4


def test_soup_has_points_and_segments_and_keeps_to_its_grid(small):
    scene = small["random_soup"]
    points = scene.at(0.3)[0]
    assert np.array_equal(np.round(points * SOUP_GRID), points * SOUP_GRID)
    different = [len(np.unique(corners, axis=0)) for corners in points[scene.triangles[0]]]
    assert {1, 2, 3} <= set(different)


def test_waves_have_about_as_many_triangles_as_asked_and_pairs_grow_as_their_root():
    pairs = []
    for number in (1000, 16_000):
        scene = crossing_waves(number)
        assert sum(map(len, scene.triangles)) == pytest.approx(number, rel=0.05)
        pairs.append(len(crossing(scene.at(0.0), scene.triangles)))
    assert pairs[1] / pairs[0] == pytest.approx(4.0, rel=0.2)
