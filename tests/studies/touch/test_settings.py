"""What is wrong with the settings of touches is said in one sentence."""

from pathlib import Path

import pytest
from fixtures.bodies import LIVER

from palpate.errors import InputError
from palpate.run.settings import defaults
from palpate.studies.press.settings import check as check_press
from palpate.studies.touch.settings import check, instruments_of

BALL = {"kind": "sphere", "radius_m": 0.008}


def settings(**given) -> dict:
    return {"bodies": {"liver": LIVER, "bar": LIVER.but(refinements=0)}, "touch": defaults("touch", **given)}


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
        check(settings(**given), Path("my.yaml"))
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
    config = {"bodies": {"liver": LIVER}, "press": defaults("press", instruments=[BALL | given])}
    with pytest.raises(InputError) as refused:
        check_press(config, Path("my.yaml"))
    assert f"my.yaml: press.instruments{said}" in str(refused.value)


def test_a_body_that_is_refined_is_needed():
    given = settings()
    del given["bodies"]["liver"]
    with pytest.raises(InputError, match="touch is there and no body is refined"):
        check(given, Path("my.yaml"))


def test_instruments_are_told_apart_by_kind_and_radius():
    punch = {"kind": "punch", "radius_m": 0.0045, "edge_m": 0.001}
    given = settings(instruments=[BALL, punch])
    check(given, Path("my.yaml"))
    assert list(instruments_of(given)) == ["sphere_8mm", "punch_4.5mm"]
    assert instruments_of(given)["punch_4.5mm"] == punch | {"length_m": 0.0, "sticks": False}
