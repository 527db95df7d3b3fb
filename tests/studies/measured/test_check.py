"""An entry that cannot be measured is refused before anything runs, in one sentence."""

from copy import deepcopy
from pathlib import Path

import pytest
from fixtures.bodies import made

from palpate.errors import InputError
from palpate.run.settings import complete, read_settings
from palpate.studies.measured.check_places import check_places

ROOT = Path(__file__).parents[3]


SHIPPED = read_settings(ROOT / "config.yaml")


@pytest.fixture
def settings() -> dict:
    """The shipped beam and its experiment, alone."""
    return deepcopy({"bodies": {"beam": SHIPPED["bodies"]["beam"]}, "measured": SHIPPED["measured"]})


def refusal(settings: dict) -> str:
    with pytest.raises(InputError) as refused:
        complete(settings, ROOT / "config.yaml")
    return str(refused.value).removeprefix(f"{ROOT}/config.yaml: ").replace(f"{ROOT}/", "")


BEAM = "measured.experiments.beam"
CHANGES = {
    "a file that there is not": (
        lambda beam, models: beam["cases"]["gravity"].update(files=["examples/beam/none.csv"]),
        f"{BEAM}.cases.gravity.files is examples/beam/none.csv, where",
    ),
    "a body that there is not": (
        lambda beam, models: beam.update(body="bam"),
        f"{BEAM}.body is bam, which is not in bodies; did you mean beam?",
    ),
    "a level that the body lacks": (
        lambda beam, models: models.update(fem_p2={"levels": [2]}),
        "measured.models.fem_p2.levels names level 2, and the body beam has levels 0 to 2",
    ),
    "a marker that a file lacks": (
        lambda beam, models: beam["markers"].update(m7={"at_m": [0.05, 0.015, 0.036]}),
        "gravity_a.csv lacks the column m7_x_m",
    ),
    "a law without a file": (
        lambda beam, models: models.update(fem_p2={"laws": ["examples/hencki.py"]}),
        "measured.models.fem_p2.laws is examples/hencki.py, where there is no file",
    ),
}


@pytest.mark.parametrize(("change", "said"), CHANGES.values(), ids=CHANGES)
def test_what_does_not_exist_is_named(settings, change, said):
    change(settings["measured"]["experiments"]["beam"], settings["measured"].setdefault("models", {}))
    assert said in refusal(settings)


EDGE = [[0.1, 0, 0.03], [0.1, 0.03, 0.03]]
BOX = "beam, which reaches from [0, 0, 0] to [0.1, 0.03, 0.03] m"
LOADS = {
    "the tip of the data's page is the clamp": (
        {"line_m": [[0, 0, 0.03], [0, 0.03, 0.03]]},
        f"line_m is where {BOX}, is held, and moves nothing",
    ),
    "the middle of the data's page is behind the clamp": (
        {"line_m": [[-0.05, 0, 0.03], [-0.05, 0.03, 0.03]]},
        f"line_m is 0.05 m off the surface of {BOX}",
    ),
    "above the edge": ({"line_m": [[0.1, 0, 0.032], [0.1, 0.03, 0.032]]}, "line_m is 0.002 m off the surface"),
    "through the body": ({"line_m": [[0.05, 0.015, 0], [0.05, 0.015, 0.03]]}, "line_m is 0.015 m off the surface"),
    "a line of no length": ({"line_m": [EDGE[0], EDGE[0]]}, "line_m is as short as a point"),
    "a wide disc": ({"at_m": EDGE[0], "radius_m": 10}, "radius_m is 10 m, more than half of beam, which reaches"),
    "a radius of a line": ({"line_m": EDGE, "radius_m": 0.01}, "leave out radius_m, which belongs to at_m"),
}


@pytest.mark.parametrize(("load", "said"), LOADS.values(), ids=LOADS)
def test_a_load_that_is_not_on_the_body_is_refused(settings, load, said):
    settings["measured"]["experiments"]["beam"]["cases"]["heavier"] = {"loads": [{"weight_n": 0.99} | load]}
    found = refusal(settings)
    assert found.startswith("measured.experiments.beam.cases.heavier.loads[0]") and said in found


def test_markers_far_from_the_body_are_refused(settings):
    markers = settings["measured"]["experiments"]["beam"]["markers"]
    markers["m1"]["at_m"][2] += 0.02
    assert f"markers.m1.at_m is 0.026 m off the surface of {BOX}" in refusal(settings)


def test_gravity_that_points_upwards_is_refused_unless_a_force_may_lift(settings):
    entry = settings["measured"]["experiments"]["beam"]
    entry["down"] = [0, 0, 1]
    said = refusal(settings)
    assert "gravity_a.csv: the markers rise by 0.00638 m against down, [0, 0, 1]" in said
    for case in entry["cases"].values():
        case["loads"] = [{"force_n": [0, 0, 1.0], "line_m": EDGE}]
    complete(settings, ROOT / "config.yaml")


def test_a_body_that_is_no_box_is_looked_at_when_it_is_made(settings):
    full = complete(settings, ROOT / "config.yaml").measured.experiments["beam"]
    full.markers["m1"].at_m[2] += 0.02
    body = made("beam", settings["bodies"]["beam"])
    with pytest.raises(InputError, match=r"m1\.at_m is 0\.026 m off"):
        check_places("beam", full, body)
