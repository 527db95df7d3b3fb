"""Bodies are as far apart as asked, in any direction, and no structure finds a crossing."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from palpate.evaluation.collision import apart_bodies
from palpate.evaluation.collision.brute_force import crossing
from palpate.evaluation.collision.separated_surfaces import two_bodies

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


def test_wider_gaps_take_fewer_tests(table):
    for _, rows in table[~table["rival"]].groupby(["bodies", "structure"]):
        tests = rows.set_index("gap_m")["node_tests"]
        assert 1 <= tests[GAPS[1]] < tests[GAPS[0]]
        # where the roots are apart, the first test suffices
        alone = rows[rows["roots_overlap"] == 0.0]
        assert (alone["node_tests"] == 1).all()
