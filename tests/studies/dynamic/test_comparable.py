"""Which scenes models can be compared in, how long they are followed, and why the others are left out."""

import pytest

from palpate.errors import InputError
from palpate.studies.dynamic.comparable import check_trial, fits, taught, trials, unable, unfit

LOAD = {"at_m": [0, 0, 0], "force_n": [0, 0, -1], "radius_m": 0, "start_s": 0.1, "press_s": 0.3, "hold_s": 9}
PRESSED = {"body": "bar", "effects": "auto", "duration_s": 5.0, "push": {"loads": [LOAD]}}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({}, ""),
        ({"effects": ["corotational", "held", "push"]}, ""),
        ({"contact": {"self_contact": True}}, "has contact"),
        ({"others": [{"body": "bar"}], "effects": ["corotational", "push"]}, "has several bodies"),
        ({"held": False}, "is not held"),
        ({"start": "random"}, "does not start at rest"),
        ({"plasticity": {"yield_strain": 0.1, "max_strain": 1}}, "has plasticity, which not all models have"),
        ({"prony": {"shares": [0.5], "times_s": [1.0]}}, "has prony, which not all models have"),
        ({"maxwell": {"stiffness_ratio": 1.0}}, "has maxwell, which not all models have"),
        ({"plasticity": {}, "effects": ["corotational", "held", "push"]}, ""),  # described, and not named
        ({"own": {"wind": "wind.py"}}, "has wind, which not all models have"),
        ({"own": {"wind": "wind.py"}, "effects": ["corotational", "held", "push"]}, ""),
    ],
)
def test_a_scene_is_left_out_for_a_reason(change, reason):
    assert unfit(PRESSED | change) == reason


def test_a_model_that_cannot_do_a_scene_is_named_before_anything_runs():
    clay = PRESSED | {"plasticity": {"yield_strain": 0.1, "max_strain": 1}}
    assert unable("springs", clay) == unable("springs_volume", clay) == "has plasticity"
    assert unable("springs", PRESSED, "sheet") == "" and unable("springs_volume", PRESSED, "sheet") == "moves a sheet"
    assert unable("detail_correction", PRESSED | {"contact": {"self_contact": True}}) == "has contact"
    for model in ("fem_coarse", "shape_matching"):
        assert unable(model, clay, "sheet") == ""


def test_without_loads_or_on_a_sheet_there_is_nothing_to_compare():
    assert unfit({name: value for name, value in PRESSED.items() if name != "push"}) == "has none of gravity and push"
    with pytest.raises(InputError, match=r"^here names press, which moves a sheet; describe"):
        check_trial("here", "press", PRESSED, "sheet")


MANY = {"others": [{"body": "bar", "shift_m": [1, 0, 0]}], "contact": {"instruments": []}, "held": False}


def test_where_a_motion_to_fit_to_is_described_more_scenes_take_part():
    assert unfit(PRESSED | MANY | {"plasticity": {}}, "sheet", taught=True) == ""
    for change, reason in (
        ({"others": [{"body": "cube", "shift_m": [1, 0, 0]}]}, "has bodies of several kinds"),
        ({"prony": {}}, "has prony, which not all models have"),
        ({"start": "random"}, "does not start at rest"),
    ):
        assert unfit(PRESSED | MANY | change, taught=True) == reason
    with pytest.raises(InputError, match="has contact; describe a motion to fit models to as its training, or"):
        check_trial("here", "pile", PRESSED | {"others": MANY["others"]})
    with pytest.raises(InputError, match="which has prony, which not all models have; choose another scene"):
        check_trial("here", "creeps", PRESSED | {"prony": {}})


def test_a_motion_to_fit_to_is_needed_where_a_model_is_fitted():
    assert fits({}) and fits({"models": ["fem_coarse", "springs"]}) and not fits({"models": ["fem_coarse"]})
    assert taught({"training": {"duration_s": 0.1}}) and taught({"models": ["fem_coarse"]}) and not taught({})


def test_scenes_are_followed_to_their_end_but_not_for_long_unless_they_are_pressed_later():
    late = PRESSED | {"push": {"loads": [LOAD, LOAD | {"start_s": 2.0}]}}
    sag = {"body": "bar", "effects": "auto", "duration_s": 0.7, "gravity": {"acceleration_m_s2": [0, 0, -9.81]}}
    cloth = PRESSED | {"body": "cloth"}
    bodies = {"bar": {"kind": "box"}, "cloth": {"kind": "sheet"}}
    found, left_out = trials({"press": PRESSED, "late": late, "sag": sag, "cloth": cloth}, bodies)
    assert found == {"press": 1.0, "late": 2.3, "sag": 0.7}
    assert left_out == {"cloth": "moves a sheet"}
