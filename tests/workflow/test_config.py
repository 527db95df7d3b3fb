"""config.yaml and its schema agree, and what is wrong is said in one sentence."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.run.settings import STUDIES, Shared, complete, defaults, json_schema

ROOT = Path(__file__).parents[2]
SMOKE = ROOT / "tests/smoke/config.yaml"
SCHEMA = json_schema()


def objects(schema):
    """Every schema in a schema."""
    if isinstance(schema, dict):
        yield schema
        for value in schema.values():
            yield from objects(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from objects(value)


def test_the_schema_is_one():
    Draft202012Validator.check_schema(SCHEMA)


def both(given: dict, default: dict, place: str = "") -> Iterator[tuple[str, object, object]]:
    """Yield each setting that has a default and is given, too: its key, what is given, and the default."""
    for key in given.keys() & default.keys():
        if isinstance(given[key], dict) and isinstance(default[key], dict):
            yield from both(given[key], default[key], f"{place}{key}.")
        else:
            yield f"{place}{key}", given[key], default[key]


def test_defaults_are_those_of_the_shipped_settings():
    given = yaml.safe_load((ROOT / "config.yaml").read_text())
    default = Shared.model_validate({}) | {
        name: defaults(name) for name in STUDIES if name not in ("measured", "scenes")
    }
    default |= {"measured": {"models": defaults("measured", experiments=given["measured"]["experiments"])["models"]}}
    found = list(both({name: block for name, block in given.items() if name not in ("bodies", "seed")}, default))
    # bodies and scenes that are shipped
    naming = (
        "tradeoff.bodies",
        "tradeoff.limit_points",
        "tradeoff.any_load",
        "tradeoff.beyond_design",
        "press.bodies",
        "law.bodies",
        "law.regions_of",
        "organ_springs.bodies",
        "shape_matching.creep",
    )
    assert [(key, value, default) for key, value, default in found if value != default and key not in naming] == []
    assert len(found) > 50


def test_the_shipped_settings_name_their_schema_for_editors(tmp_path):
    first = (ROOT / "config.yaml").read_text().splitlines()[0]
    place = first.removeprefix("# yaml-language-server: $schema=")
    assert place != first and f"SCHEMA := {place}".replace(".venv", "$(VENV)") in (ROOT / "Makefile").read_text()
    done = subprocess.run([sys.executable, "-m", "palpate.run.settings", tmp_path / "schema.json"], check=False)
    assert (
        done.returncode == 0
        and json.loads((tmp_path / "schema.json").read_text())["properties"].keys() == SCHEMA["properties"].keys()
    )


def test_every_study_has_settings_and_a_block_in_the_shipped_settings():
    given = yaml.safe_load((ROOT / "config.yaml").read_text())
    assert set(STUDIES) <= set(given)
    assert {path.parent.name for path in (ROOT / "src/palpate/studies").glob("*/settings.py")} == set(STUDIES)


def test_every_key_is_described_and_every_block_closed():
    for schema in objects(SCHEMA):
        for key, inner in schema.get("properties", {}).items():
            assert inner.get("description") or SCHEMA["$defs"][inner["$ref"].split("/")[-1]]["description"], key
        if schema.get("type") == "object" and "properties" in schema:
            assert schema["additionalProperties"] is False, schema


def test_defaults_fill_what_is_left_out(smoke):
    given = {key: smoke[key] for key in ("bodies", "regimes")} | {"enrichment": None}
    full = complete(given, Path("config.yaml"))
    assert set(full) == set(SCHEMA["properties"]) - set(STUDIES) | {"enrichment"}
    assert set(full["enrichment"]["sigma_relative"]) == {"min", "max", "count"}


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("sed", 1, "the file has an unknown key sed; did you mean seed?"),
        ("bodies.liver.poison", 0.3, "bodies.liver has an unknown key poison; did you mean poisson?"),
        (
            "bodies.liver.poisson",
            0.5,
            "bodies.liver.poisson is 0.5, but must be below 0.5 (Poisson's ratio).",
        ),
        (
            "bodies.liver.young_pa",
            -1,
            "bodies.liver.young_pa is -1, but must be above 0 (Young's modulus [Pa]).",
        ),
        ("bodies.liver.young_pa", float("nan"), "bodies.liver.young_pa is nan; give a finite number."),
        ("bodies.liver.length_m", None, "bodies.liver lacks length_m; add it (Longest side [m])."),
        ("bodies.liver.train", 7, "bodies.liver.train is 7; make it a multiple of the 2 magnitudes,"),
        (
            "bodies.liver.kind",
            "livr",
            "bodies.liver.kind is 'livr', but must be one of cylinder, liver, file",
        ),
        ("bodies.My Liver", {}, "bodies has an entry 'My Liver'; name it in lower-case letters"),
        ("bodies.liver.anchors.nodes", [1], "bodies.liver.anchors is {"),
        (
            "tradeoff",
            {"settings": {"coarse_answers": ["linear", "4 iteration"]}},
            "tradeoff.settings.coarse_answers[1] is '4 iteration'; give linear, 1 iteration, 4 iterations, loose, or",
        ),
        ("bodies.liver.law", "rubber", "bodies.liver.law is 'rubber'; give corotational, stable_neo_hookean, neo"),
        ("tradeoff", {"advice": {"max_errors": [5]}}, "tradeoff.advice.max_errors[0] is 5, but must be below 1"),
        ("regimes.small.pressure_of_young", 5, "regimes.small.pressure_of_young is 5, but must be at most 1 (High"),
        (
            "solver.tolerance",
            "1e-8",
            "solver.tolerance is the text '1e-8'; write the number without quotes",
        ),
        (
            "bodies.liver.refinements",
            2,
            "bodies.liver.paper_surface has 2 entries; give one for each",
        ),
        (
            "enrichment.sigma_relative.min",
            10,
            "enrichment.sigma_relative.min is 10; make it less than",
        ),
        ("enrichmnt", {}, "the file has an unknown key enrichmnt; did you mean enrichment?"),
        ("scenes", {}, "scenes is empty; give it an entry, or remove the key"),
        ("bodies.liver", {"young_pa": None}, "bodies.liver lacks kind; add it"),
        ("bodies.liver.young_pa", "3 kPa", "bodies.liver.young_pa is the text '3 kPa'; write the number alone, in the"),
        ("bodies.liver.young_pa", "3,5", "bodies.liver.young_pa is the text '3,5'; write the number with a point, 3.5"),
        ("bodies.liver.train", 8.5, "bodies.liver.train is 8.5, but must be a whole number (Paper 1's samples"),
        ("solver", [1e-8], "solver is [1e-08], but must be a block of keys (Newton's method for static"),
        ("bodies.abdomen.snap", "yes", "bodies.abdomen.snap is the text 'yes'; write true"),
        ("seed", 2**40, "seed is 1099511627776, but must be at most 2147483647"),
        ("springs.young_pa", [3000, 300], "springs.young_pa is [3000, 300]; give the lower number first."),
        ("springs.duration_s", 1e-5, "springs.duration_s is 1e-05, and step_s 0.0004; give the time of one"),
        (
            "springs.key_points_m",
            [[0, 0, 0.01], [0, 0, 0.02]],
            "springs.key_points_m[1] is [0, 0, 0.02], which is outside the cube; give coordinates from 0 to",
        ),
        (
            "enrichment.regimes",
            {"small": {"peak_of_size": 0.02}},
            "enrichment.regimes.small is under regimes, too; give it another name.",
        ),
    ],
)
def test_what_is_wrong_is_said(smoke, place, value, said):
    *parents, key = place.split(".")
    inner = smoke
    for name in parents:
        inner = inner[name]
    inner[key] = value
    if value is None:
        del inner[key]
    with pytest.raises(InputError) as caught:
        complete(smoke, Path("my.yaml"))
    assert str(caught.value).startswith(f"my.yaml: {said}")
    assert "\n" not in str(caught.value)


def test_a_study_is_checked_for_who_asks_for_it(smoke):
    smoke["springs"]["side_m"] = 0.001
    with pytest.raises(InputError, match=r"springs\.key_points_m\[0\] is"):
        complete(smoke, Path("my.yaml"))
    del smoke["springs"]
    complete(smoke, Path("my.yaml"))


def test_masses_from_ct_need_a_body_from_ct(smoke):
    del smoke["bodies"]["abdomen"], smoke["palpation"]
    with pytest.raises(InputError, match=r"my\.yaml: ct is there and no body is of kind ct; add such a body"):
        complete(smoke, Path("my.yaml"))


def test_nothing_asked_for_is_reported(smoke):
    with pytest.raises(InputError, match="nothing is asked for"):
        complete({"bodies": smoke["bodies"]}, Path("my.yaml"))


def test_scenes_are_completed_down_to_their_loads():
    full = complete(read_yaml(ROOT / "config.yaml"), ROOT / "config.yaml")
    scene = full["scenes"]["clay_dent"]
    assert scene["held"] is True and scene["start"] == "rest" and scene["level"] == 0
    del full["scenes"]["clay_dent"]["push"]["loads"][0]["hold_s"]
    full["scenes"]["sheet_drape"]["contact"]["instruments"] = [{"kind": "floor", "height_m": -0.1}]
    again = complete(full, ROOT / "config.yaml")
    assert again["scenes"]["clay_dent"]["push"]["loads"][0]["hold_s"] == 0.5
    assert again["scenes"]["sheet_drape"]["contact"]["instruments"][0]["axis"] == "z"


BALL = {"kind": "sphere", "center_m": [0, 0, 1], "radius_m": 0.1}


@pytest.mark.parametrize(
    ("tools", "said"),
    [
        (
            [BALL | {"times_s": [0, 1], "shifts_m": [[0, 0, 0]]}],
            r"\[0\]\.times_s has 2 entries, and shifts_m has 1; give",
        ),
        ([BALL | {"times_s": [0]}], r"\[0\]\.times_s has 1 entries, and shifts_m has 0; give"),
        (
            [BALL, BALL | {"times_s": [0, 2, 1], "shifts_m": [[0, 0, 0]] * 3}],
            r"\[1\]\.times_s has 1 after 2; give times in increasing order",
        ),
        ([BALL | {"name": "a"}, BALL, BALL | {"name": "a"}], r"\[2\] is called a, as instruments\[0\] is; give"),
        ([BALL | {"name": "sphere_1"}, BALL], r"\[1\] is called sphere_1, as instruments\[0\] is; give"),
        ([BALL | {"name": "bar"}], r"\[0\] is called bar, as a body is; give"),
        ([BALL | {"name": "bar_1"}], r"\[0\] is called bar_1, as a body is; give"),
    ],
)
def test_what_is_wrong_with_instruments_is_said(tools, said):
    given = read_yaml(ROOT / "config.yaml")
    given["scenes"]["bar_sag"]["contact"] = {"instruments": tools}
    with pytest.raises(InputError, match=r"^my\.yaml: scenes\.bar_sag\.contact\.instruments" + said) as caught:
        complete(given, Path("my.yaml"))
    assert str(caught.value).endswith(".") and ". " not in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("body", "livr", "scenes.bar_sag names the body livr, which is not under bodies; did you mean liver?"),
        ("effects", "all", "scenes.bar_sag.effects is 'all'; write auto, or a list"),
        ("gravity", {"g": 1}, "scenes.bar_sag.gravity has an unknown key g"),
        ("own", {"wind": "wind.py"}, "scenes.bar_sag.own.wind is wind.py, where there is no file"),
        ("effects", ["corotationl"], "scenes.bar_sag.effects names corotationl, which is unknown; did you mean coro"),
        ("level", 1, "scenes.bar_sag.level is 1, and bar has levels 0 to 0"),
        ("own_settings", {"wind": {}}, "scenes.bar_sag.own_settings names wind, and own does not"),
        ("step_s", 0, "scenes.bar_sag.step_s is 0, but must be above 0"),
    ],
)
def test_what_is_wrong_with_a_scene_is_said(key, value, said):
    given = read_yaml(ROOT / "config.yaml")
    given["scenes"]["bar_sag"][key] = value
    with pytest.raises(InputError) as caught:
        complete(given, ROOT / "config.yaml")
    assert f": {said}" in str(caught.value)
