"""Every instrument touches every body, and each model has a job of its own there, one of the user's too."""

import pytest

from palpate.studies.touch.settings import MODELS as TOUCH_MODELS

pytestmark = pytest.mark.slow


def test_instruments_and_bodies_have_jobs_of_their_own(whole, write_config, plan, tmp_path):
    punch = {"kind": "punch", "radius_m": 0.0125, "edge_m": 0.002}
    touch = {"bodies": ["block", "liver"], "instruments": [{"kind": "sphere", "radius_m": 0.015}, punch]}
    mine = "class Mine:\n    def prepare(self, case): pass\n    def touch(self, touch): pass\n"
    (tmp_path / "mine.py").write_text(mine)
    settings = whole | {"touch": whole["touch"] | touch, "own_models": {"mine": "mine.py"}}
    jobs = plan(tmp_path, write_config(settings), "touch")
    assert jobs["simulate_touch_truth"] == 4
    assert jobs["measure_touch_models"] == 4 * (len(TOUCH_MODELS) + 1)
    assert jobs["make_body"] == 2 and jobs["tabulate_touch"] == 1
