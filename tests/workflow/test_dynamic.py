"""Every scene in which models can be compared takes part, without being named."""

from pathlib import Path

import pytest
from fixtures.small_scene import BAR, SCENE

from palpate.studies.dynamic.elsewhere import tabulate_dynamic

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
FLOOR = {"contact": {"instruments": [{"kind": "floor", "height_m": -1.0}]}}


@pytest.fixture
def settings():
    return {"bodies": {"bar": BAR | {"poisson": 0.3}}, "scenes": {"mine": SCENE | {"body": "bar"}}, "dynamic": {}}


def test_an_own_scene_gets_advice_without_being_named(plan, write_config, tmp_path, settings):
    jobs = plan(tmp_path, write_config(settings), "dynamic")
    assert jobs == {
        "make_body": 1, "simulate_dynamic_reference": 1, "measure_dynamic": 1, "tabulate_dynamic": 1,
        "tabulate_advice": 1, "write_report": 1, "dynamic": 1,
    }  # fmt: skip


def test_only_scenes_that_are_named_take_part_if_any_are(plan, write_config, tmp_path, settings):
    settings["scenes"]["other"] = settings["scenes"]["mine"]
    settings["scenes"]["falls"] = settings["scenes"]["mine"] | FLOOR  # with contact, if its training is described
    settings["dynamic"]["scenes"] = {"mine": {"duration_s": 0.1}}
    settings["dynamic"]["scenes"]["falls"] = {"duration_s": 0.1, "training": {"duration_s": 0.05}}
    jobs = plan(tmp_path, write_config(settings))
    assert jobs["measure_dynamic"] == 2


def test_what_cannot_be_compared_is_left_out_with_a_warning(plan, write_config, tmp_path, settings):
    settings["scenes"]["falls"] = settings["scenes"]["mine"] | FLOOR
    jobs = plan(tmp_path, write_config(settings))
    assert jobs["measure_dynamic"] == 1 and jobs["simulate_scene"] == 2
    with pytest.warns(UserWarning, match=r"scenes\.falls: models are not compared in it, as it has contact\."):
        tabulate_dynamic({}, [], {"falls": "has contact"})


def test_a_scene_with_one_push_is_asked_at_other_places(plan, write_config, tmp_path, settings):
    push = {"at_m": [0.2, 0.025, 0.05], "force_n": [0, 0, -0.01], "radius_m": 0.02, "start_s": 0.0, "press_s": 0.1}
    push |= {"hold_s": 0.1, "release_s": 0.1}
    settings["scenes"]["mine"]["push"] = {"loads": [push]}
    del settings["scenes"]["mine"]["gravity"]
    settings["dynamic"]["scenes"] = {"mine": {"duration_s": 0.1, "elsewhere": {"places": 10}}}
    jobs = plan(tmp_path, write_config(settings), "dynamic")
    assert jobs["measure_elsewhere"] == 1
    assert plan(tmp_path, write_config(settings), "results/tables/motion_bounds.csv")["tabulate_dynamic"] == 1


def test_a_truth_is_found_of_the_scenes_that_ask_for_one(plan, write_config, tmp_path, settings):
    settings["scenes"]["other"] = settings["scenes"]["mine"]
    settings["dynamic"]["scenes"] = {"mine": {"duration_s": 0.1, "truth": {}}, "other": {"duration_s": 0.1}}
    jobs = plan(tmp_path, write_config(settings), "dynamic")
    assert jobs["find_motion_truth"] == 1 and jobs["measure_dynamic"] == jobs["simulate_dynamic_reference"] == 2


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
