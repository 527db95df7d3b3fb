"""Every instrument touches every body, and each model has a job of its own there, one of the user's too."""

import pytest

from palpate.models.model_registry import TOUCH_MODELS

pytestmark = pytest.mark.slow


def test_instruments_and_bodies_have_jobs_of_their_own(whole, write_config, plan, tmp_path):
    whole["touch"] |= {"bodies": ["block", "liver"]}
    whole["touch"]["instruments"] = [
        {"kind": "sphere", "radius_m": 0.015},
        {"kind": "punch", "radius_m": 0.0125, "edge_m": 0.002},
    ]
    mine = "class Mine:\n    def prepare(self, case): pass\n    def touch(self, touch): pass\n"
    (tmp_path / "mine.py").write_text(mine)
    whole["own_models"] = {"mine": "mine.py"}
    jobs = plan(tmp_path, write_config(whole), "touch")
    assert jobs["simulate_touch_truth"] == 4
    assert jobs["measure_touch_models"] == 4 * (len(TOUCH_MODELS) + 1)
    assert jobs["make_body"] == 2 and jobs["tabulate_touch"] == 1
