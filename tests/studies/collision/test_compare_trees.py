"""The table has what was measured, and counts the missed and extra pairs of a structure."""

import numpy as np
import pandas as pd
import pytest

from palpate.studies.brute_force import crossing
from palpate.studies.collision import compare_trees
from palpate.studies.prescribed_motions import random_soup, two_livers

FRAMES = 4


@pytest.fixture(scope="module")
def table():
    done = []
    found = compare_trees.measure(FRAMES, 0, [[1, 1]], seed=1, report=done.append)
    assert done == list(dict.fromkeys(found["scene"]))
    return found


def test_no_structure_of_palpate_misses_a_pair_or_makes_one_up_in_any_scene(table):
    tested = table[~table["rival"]]
    assert len(tested) == 4 * 6 and set(tested["depths"]) == {"", "1/1"}
    for _, rows in tested.groupby("scene"):
        assert list(rows["structure"]) == [*compare_trees.PURE, "composite"]
        assert rows["pairs"].nunique() == rows["triangles"].nunique() == 1
    assert (tested["frames"] == FRAMES).all()
    assert (tested[["missed_pairs", "extra_pairs"]] == 0).all(axis=None)
    assert (tested[["build_ms", "refit_ms", "query_ms", "frame_ms", "node_tests"]] > 0).all(axis=None)
    assert (tested["triangle_tests"] >= tested["pairs"]).all()
    assert (tested["frame_ms"] >= tested[["refit_ms", "query_ms"]].max(axis=1)).all()


class Careless:
    """Leaves out the first true pair and reports one that does not cross."""

    refits = True

    def __init__(self, triangles, points):
        self.triangles, self.points = triangles, points

    def update(self, points):
        self.points = points

    def query(self):
        true = crossing(self.points, self.triangles)
        return np.vstack([true[1:], [[0, 0]]])


def test_missed_and_made_up_pairs_are_counted():
    scene = two_livers(0)
    rows = compare_trees._scene_rows(scene, FRAMES, {("careless", "", False): Careless})
    row = compare_trees.COLLISION.frame(rows).loc[0]
    assert [0, 0] not in crossing(scene.at(0.0), scene.triangles).tolist()
    assert (row["missed_pairs"], row["extra_pairs"]) == (FRAMES, FRAMES)


def test_a_worn_tree_is_rebuilt_and_still_finds_every_pair():
    scene = random_soup(60, seed=1)
    tested = compare_trees.RefittedTrees("composite", (2, 2), scene.triangles, scene.at(0.0))
    random = np.random.default_rng(0)
    for _ in range(3):
        # every triangle goes somewhere else
        orders = [np.argsort(random.random(len(at) // 3)) for at in scene.at(0.5)]
        points = [at.reshape(-1, 3, 3)[order].reshape(-1, 3) for at, order in zip(scene.at(0.5), orders, strict=True)]
        tested.update(points)
        assert np.array_equal(tested.query(), crossing(points, scene.triangles))
    assert tested.rebuilds


@pytest.mark.parametrize(("kind", "package"), [("Fcl", "fcl"), ("Coal", "coal"), ("CoalRefit", "coal")])
def test_pairs_are_ours_in_every_frame(kind, package):
    pytest.importorskip(package)
    scene = two_livers(0)
    rival = getattr(compare_trees, kind)(scene.triangles, scene.at(0.0))
    for time in (0.1, 0.5, 0.9):
        points = scene.at(time)
        rival.update(points)
        found = rival.query()
        assert len(found)
        assert np.array_equal(found[np.lexsort((found[:, 1], found[:, 0]))], crossing(points, scene.triangles))


def test_exponents_are_those_of_the_powers_and_leave_small_meshes_out_and_one_size_has_none():
    sizes = np.array([1000, 10_000, 100_000, 1_000_000])
    rows = {"structure": "aabb", "depths": "", "rival": False, "triangles": sizes, "build_ms": 2e-4 * sizes**1.1}
    rows |= {"refit_ms": 1e-4 * sizes, "query_ms": 1e-2 * sizes**0.5}
    table = pd.DataFrame(rows)
    table.loc[0, "refit_ms"] = 50.0
    stages = list(compare_trees.STAGES)
    assert compare_trees.exponents(table).loc[0, stages].tolist() == pytest.approx([1.1, 1.0, 0.5])
    assert compare_trees.exponents(table[-1:])[stages].isna().all(axis=None)
