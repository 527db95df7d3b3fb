"""Every scene in which models can be compared takes part, without being named."""

from pathlib import Path

import pytest
from fixtures.small_scene import BAR, SCENE

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture
def settings():
    return {"bodies": {"bar": BAR | {"poisson": 0.3}}, "scenes": {"mine": SCENE | {"body": "bar"}}, "dynamic": {}}


def test_an_own_scene_gets_advice_without_being_named(plan, write_config, tmp_path, settings):
    jobs = plan(tmp_path, write_config(settings), "dynamic")
    assert jobs == {
        "make_body": 1, "simulate_dynamic_reference": 1, "measure_dynamic": 1, "tabulate_dynamic": 1,
        "tabulate_advice": 1, "write_report": 1, "dynamic": 1,
    }  # fmt: skip


def test_models_wait_for_what_says_how_well_a_motion_is_known(plan, write_config, tmp_path, settings):
    """Meshes of linear elements, too, as these say until when models are judged."""
    target, found = "results/data/dynamic/mine/accuracy.csv", []
    for truth in ({"truth": {"elements": "quadratic"}}, {"truth": {"elements": "linear"}}, {}):
        settings["dynamic"]["scenes"] = {"mine": {"duration_s": 0.1} | truth}
        found.append("find_motion_truth" in plan(tmp_path, write_config(settings), target))
    assert found == [True, True, False]


def test_what_takes_hours_can_be_planned(plan, tmp_path):
    files = [ROOT / f"config{size}.yaml" for size in ("", ".full", ".deep")]
    jobs = plan(tmp_path, files[0], "--configfile", *map(str, files))
    assert jobs["measure_held_out"] == 2 and jobs["simulate_strokes"] == 4 and jobs["measure_touch_models"] > 80
