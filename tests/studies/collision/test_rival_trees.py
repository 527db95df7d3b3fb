"""The rivals find the same pairs where rounding cannot matter, and their absence is reported."""

from importlib.util import find_spec

import numpy as np
import pytest

from palpate.collision.moving_surfaces import two_livers
from palpate.collision.triangles.brute_force import crossing
from palpate.studies.collision import compare_trees

KINDS = {"Fcl": "fcl", "Coal": "coal", "CoalRefit": "coal"}


@pytest.mark.parametrize("kind", KINDS)
def test_pairs_are_ours_in_every_frame(kind):
    if find_spec(KINDS[kind]) is None:
        pytest.skip(f"{KINDS[kind]} is not installed")
    scene = two_livers(0)
    rival = getattr(compare_trees, kind)(scene.triangles, scene.at(0.0))
    for time in (0.1, 0.5, 0.9):
        points = scene.at(time)
        rival.update(points)
        found = rival.query()
        assert len(found)
        assert np.array_equal(found[np.lexsort((found[:, 1], found[:, 0]))], crossing(points, scene.triangles))


def test_a_package_that_is_not_there_is_named_and_left_out(monkeypatch):
    monkeypatch.setattr(compare_trees, "find_spec", lambda package: None if package == "coal" else "here")
    found, missing = compare_trees.installed()
    assert list(found) == ["obb_rss_fcl"]
    assert missing == ["coal"]
