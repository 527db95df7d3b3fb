"""Which scenes models can be compared in, how long they are followed, and why the others are left out."""

from types import SimpleNamespace

import pytest

from palpate.benchmark.comparable import check_compared, compared_scenes, fits, unable, unfit
from palpate.effects.settings import Ball, Contact, Floor
from palpate.errors import InputError
from palpate.scenes.settings import Scene

LOAD = {"at_m": [0, 0, 0], "force_n": [0, 0, -1], "radius_m": 0, "start_s": 0.1, "press_s": 0.3, "hold_s": 9}
PRESSED = Scene(body="bar", step_s=0.01, duration_s=5.0, push={"loads": [LOAD]})


MANY = {"others": [{"body": "bar", "shift_m": [1, 0, 0]}], "contact": {"instruments": []}, "held": False}
SERIES = {"shares": [0.5], "times_s": [1.0]}
CLAY = {"yield_strain": 0.1, "max_strain": 1}


@pytest.mark.parametrize(
    ("change", "kind", "taught", "reason"),
    [
        ({}, "", False, ""),
        ({}, "sheet", False, "moves a sheet"),
        ({"contact": {"self_contact": True}}, "", False, "has contact"),
        ({"others": MANY["others"]}, "", False, "has several bodies"),
        ({"held": False}, "", False, "is not held"),
        ({"start": "random"}, "", False, "does not start at rest"),
        ({"plasticity": CLAY}, "", False, "has plasticity, which not all models have"),
        ({"prony": SERIES}, "", False, "has prony, which not all models have"),
        (
            {"maxwell": {"stiffness_ratio": 1.0, "relaxation_s": 1.0}},
            "",
            False,
            "has maxwell, which not all models have",
        ),
        ({"own": {"wind": "wind.py"}}, "", False, "has wind, which not all models have"),
        # where a motion to fit to is described, more scenes take part
        (MANY | {"plasticity": CLAY}, "sheet", True, ""),
        (MANY | {"others": [{"body": "cube", "shift_m": [1, 0, 0]}]}, "", True, "has bodies of several kinds"),
        (MANY | {"prony": SERIES}, "", True, "has prony, which not all models have"),
        (MANY | {"start": "random"}, "", True, "does not start at rest"),
    ],
)
def test_a_scene_is_left_out_for_a_reason(change, kind, taught, reason):
    assert unfit(PRESSED.but(**change), kind, taught) == reason


def test_without_loads_there_is_nothing_to_compare():
    assert unfit(PRESSED.but(push=None)) == "has none of gravity and push"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"contact": {}}, "^here names pile, which has contact; describe a motion to fit models to as its"),
        ({"prony": SERIES}, "which has prony, which not all models have; choose another scene"),
    ],
)
def test_what_is_left_out_cannot_be_asked_for(change, said):
    with pytest.raises(InputError, match=said):
        check_compared("here", "pile", PRESSED.but(**change))


def test_a_model_that_cannot_do_a_scene_is_named_before_anything_runs():
    clay = PRESSED.but(plasticity=CLAY)
    assert unable("springs", clay) == unable("springs_volume", clay) == "has plasticity"
    assert unable("springs", PRESSED, "sheet") == "" and unable("springs_volume", PRESSED, "sheet") == "moves a sheet"
    assert unable("detail_correction", PRESSED.but(contact={"self_contact": True})) == "has contact"
    for model in ("fem_coarse", "shape_matching"):
        assert unable(model, clay, "sheet") == ""
    tools = Floor(height_m=0.0), Ball(center_m=[0, 0, 1], radius_m=0.1)
    floor, ball = (PRESSED.but(contact=Contact(instruments=[tool])) for tool in tools)
    assert unable("truth", ball) == "" and unable("truth", clay) == "has plasticity"
    assert unable("truth", floor) == "is touched by a floor and not by spheres and capsules"
    assert unable("truth", PRESSED, "sheet") == "moves a sheet"


def test_a_motion_to_fit_to_is_needed_where_a_model_is_fitted():
    assert fits(None) and fits(["fem_coarse", "springs"]) and not fits(["fem_coarse"])


def test_scenes_are_followed_to_their_end_but_not_for_long_unless_they_are_pressed_later():
    late = PRESSED.but(push={"loads": [LOAD, LOAD | {"start_s": 2.0}]})
    sag = PRESSED.but(duration_s=0.7, push=None, gravity={"acceleration_m_s2": [0, 0, -9.81]})
    cloth = PRESSED.but(body="cloth")
    bodies = {"bar": SimpleNamespace(kind="box"), "cloth": SimpleNamespace(kind="sheet")}
    found, left_out = compared_scenes({"press": PRESSED, "late": late, "sag": sag, "cloth": cloth}, bodies)
    assert found == {"press": 1.0, "late": 2.3, "sag": 0.7}
    assert left_out == {"cloth": "moves a sheet"}
