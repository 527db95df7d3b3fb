"""The trade-off is planned a family of models at a time."""

import pytest

pytestmark = pytest.mark.slow


def test_bodies_in_depth_get_all_splits(tmp_path, plan, write_config, trading):
    trading["tradeoff"] |= {"bodies": ["liver", "abdomen"], "splits": [1, 2], "in_depth": ["liver"]}
    jobs = plan(tmp_path, write_config(trading), "tradeoff")
    families, scenes = 2, 1
    assert jobs["measure_models"] == families * (2 * scenes + scenes)
    assert jobs["choose_presses"] == jobs["simulate_truth"] == 2 * scenes
    assert jobs["measure_bounds"] == 2 * scenes + scenes
