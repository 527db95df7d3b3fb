"""What is wrong with the settings of touches is said in one sentence."""

from pathlib import Path

import pytest

from palpate.benchmark.settings import instrument_name
from palpate.errors import InputError
from palpate.run.settings import complete

HELD = {"plane": {"axis": "y", "side": "max", "depth_m": 0.06}}
BODY = {"kind": "liver", "length_m": 0.2, "refinements": 1, "young_pa": 3000, "poisson": 0.3, "anchors": HELD}
BALL = {"kind": "sphere", "radius_m": 0.008}


def asked(study: str, given: dict, **bodies: dict):
    """Check the settings of a study of a liver that is refined, and one that is not."""
    return complete(
        {"bodies": {"liver": BODY, "bar": BODY | {"refinements": 0}} | bodies, study: given}, Path("my.yaml")
    )


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"models": ["fme"]}, "touch.models names fme, which is unknown; did you mean fem?"),
        ({"bodies": ["livr"]}, "touch.bodies names livr, which is unknown"),
        ({"bodies": ["bar"]}, "touch.bodies names bar, which is not refined; give it refinements"),
        ({"depth_of_radius": [0.5, 0.25]}, "touch.depth_of_radius is [0.5, 0.25]; give the lower number first."),
        ({"instruments": [BALL, BALL]}, "touch.instruments[1] has the kind and radius_m of instruments[0], by which"),
        ({"instruments": [BALL | {"radius_m": 8}]}, "touch.instruments[0].radius_m is 8, and all of liver is 0.2 m"),
        ({"instruments": [BALL | {"edge_m": 0.001}]}, "touch.instruments[0].edge_m is 0.001, and a sphere has none"),
        ({"instruments": [BALL | {"length_m": 0.1}]}, "touch.instruments[0].length_m is 0.1, and a sphere has none"),
        ({"instruments": [BALL | {"kind": "punch", "edge_m": 0.009}]}, ".edge_m is 0.009; give at most its radius_m"),
    ],
)
def test_what_is_wrong_is_said(given, said):
    with pytest.raises(InputError) as refused:
        asked("touch", given)
    assert said in str(refused.value) and str(refused.value).startswith("my.yaml: touch")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "capsule", "length_m": 0.02}, "[0] is a capsule; give a sphere or a punch"),
        ({"sticks": True}, "[0] is a sphere that sticks; give a sphere or a punch that slides."),
        ({"edge_m": 0.001}, "[0].edge_m is 0.001, and a sphere has none"),
    ],
)
def test_the_page_offers_what_it_can_answer(given, said):
    with pytest.raises(InputError) as refused:
        asked("press", {"instruments": [BALL | given]})
    assert f"my.yaml: press.instruments{said}" in str(refused.value)


def test_a_body_that_is_refined_is_needed():
    with pytest.raises(InputError, match="touch is there and no body is refined"):
        asked("touch", {}, liver=BODY | {"refinements": 0})


def test_instruments_are_told_apart_by_kind_and_radius():
    tools = asked("touch", {"instruments": [BALL, {"kind": "punch", "radius_m": 0.0045}]}).touch.instruments
    assert list(map(instrument_name, tools)) == ["sphere_8mm", "punch_4.5mm"]
