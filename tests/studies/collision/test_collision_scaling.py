"""Growth: what is measured, and the exponents fitted to it."""

import numpy as np
import pandas as pd
import pytest

from palpate.studies.collision import compare_trees


def test_each_structure_is_timed_at_each_size():
    done = []
    table = compare_trees.measure_growth([400, 900], [[1, 1]], done.append)
    assert done == [400, 900]
    tested = table[~table["rival"]]
    assert (tested.groupby(["structure", "depths"]).size() == 2).all()
    assert (tested[list(compare_trees.STAGES)] > 0).all(axis=None)
    assert tested.groupby("triangles")["pairs"].nunique().eq(1).all()


def test_exponents_are_those_of_the_powers_and_leave_small_meshes_out():
    sizes = np.array([1000, 10_000, 100_000, 1_000_000])
    rows = {"structure": "aabb", "depths": "", "rival": False, "triangles": sizes, "build_ms": 2e-4 * sizes**1.1}
    rows |= {"refit_ms": 1e-4 * sizes, "query_ms": 1e-2 * sizes**0.5}
    table = pd.DataFrame(rows)
    table.loc[0, "refit_ms"] = 50.0
    found = compare_trees.exponents(table).iloc[0]
    assert [found[stage] for stage in compare_trees.STAGES] == pytest.approx([1.1, 1.0, 0.5])


def test_one_size_gives_no_exponent():
    table = pd.DataFrame({"structure": ["obb"], "depths": [""], "rival": [False], "triangles": [9000]})
    table = table.assign(build_ms=1.0, refit_ms=1.0, query_ms=1.0)
    assert compare_trees.exponents(table)[list(compare_trees.STAGES)].isna().all(axis=None)
