"""Bodies are as far apart as asked, in any direction, and no structure finds a crossing."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from palpate.collision.moving_surfaces import two_bodies
from palpate.collision.trees.build_tree import CHILD
from palpate.collision.trees.tree import Tree
from palpate.collision.triangles.brute_force import crossing
from palpate.studies.collision import apart_bodies
from palpate.studies.collision.apart_bodies import searched_pairs

GAPS = [0.004, 0.05]


@pytest.fixture(scope="module")
def table():
    done = []
    found = apart_bodies.measure(GAPS, 3, 0, [[1, 1]], seed=1, report=done.append)
    assert done == ["two_livers", "instrument"]
    return found


def test_placed_bodies_have_the_gap(monkeypatch):
    for bodies in two_bodies(0).values():
        for gap, points in apart_bodies._place(bodies, GAPS, np.random.default_rng(2)):
            # dense points of both surfaces: no nearer than the gap, and not much farther
            dense = [_spread(at, cells) for at, (_, cells) in zip(points, bodies, strict=True)]
            nearest = KDTree(dense[0]).query(dense[1])[0].min()
            assert gap <= nearest < 1.01 * gap + 0.002
            assert not len(crossing(points, [cells for _, cells in bodies]))


def _spread(points, triangles, parts=12):
    u, v = np.meshgrid(np.arange(parts + 1), np.arange(parts + 1))
    kept = u + v <= parts
    share = np.column_stack([u[kept], v[kept], parts - u[kept] - v[kept]]) / parts
    return np.einsum("pc,tci->tpi", share, points[triangles]).reshape(-1, 3)


def test_no_structure_finds_a_crossing_or_tests_many_triangles(table):
    assert (table["extra_pairs"] == 0).all()
    assert (table["placements"] == 3).all()
    own = table[~table["rival"]]
    assert (own[["query_ms", "refit_ms", "frame_ms"]] > 0).all(axis=None)
    assert own["roots_overlap"].between(0, 1).all()


def test_a_test_of_volumes_is_timed_on_the_pairs_of_a_search(table):
    plain = ~table["rival"] & (table["structure"] != "composite")
    assert (table.loc[plain, "test_ns"] > 0).all() and table.loc[~plain, "test_ns"].isna().all()
    assert table["gap_m"].tolist()[:2] == GAPS
    (points, cells), _ = two_bodies(0)["two_livers"]
    for structure in ("sphere", "aabb", "obb", "dop18"):
        trees = [Tree(at, cells, structure) for at in (points, points + 0.01)]
        pairs = searched_pairs(*trees)
        assert len(np.unique(pairs, axis=0)) == len(pairs) and (pairs[0] == 0).all()
        # all leaves that overlap are reached: as many as the search tests
        leaves = [tree.nodes[column, CHILD] < 0 for tree, column in zip(trees, pairs.T, strict=True)]
        assert (leaves[0] & leaves[1]).sum() > 0


def test_wider_gaps_take_fewer_tests(table):
    for _, rows in table[~table["rival"]].groupby(["bodies", "structure"]):
        tests = rows.set_index("gap_m")["node_tests"]
        assert 1 <= tests[GAPS[1]] < tests[GAPS[0]]
        # where the roots are apart, the first test suffices
        alone = rows[rows["roots_overlap"] == 0.0]
        assert (alone["node_tests"] == 1).all()
