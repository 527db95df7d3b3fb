"""config.yaml and its schema agree, and what is wrong is said in one sentence."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fixtures import small_scene
from fixtures.shipped import settings_of_full
from jsonschema import Draft202012Validator

from palpate.errors import InputError
from palpate.run.settings import STUDIES, Shared, complete, defaults, json_schema
from palpate.setting_types import plain

ROOT = Path(__file__).parents[2]
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


def both(given: dict, default: dict, place: str = "") -> Iterator[tuple[str, object, object]]:
    """Yield each setting that has a default and is given, too: its key, what is given, and the default."""
    for key in given.keys() & default.keys():
        if isinstance(given[key], dict) and isinstance(default[key], dict):
            yield from both(given[key], default[key], f"{place}{key}.")
        else:
            yield f"{place}{key}", given[key], default[key]


def test_defaults_are_those_of_the_shipped_settings():
    given = settings_of_full()
    default = plain(Shared()) | {name: plain(defaults(name)) for name in STUDIES if name not in ("measured", "scenes")}
    default |= {"measured": {"models": defaults("measured", experiments=given["measured"]["experiments"]).models}}
    found = list(both({name: block for name, block in given.items() if name not in ("bodies", "seed")}, default))
    # of which bodies and scenes are shipped
    naming = {f"tradeoff.{name}" for name in ("bodies", "limit_points", "any_load", "beyond_design")}
    naming |= {"solver.samples_per_job"}
    naming |= {
        "press.bodies",
        "press.instruments",
        "law.bodies",
        "law.regions_of",
        "organ_springs.bodies",
        "shape_matching.creep",
    }
    naming |= {"touch.bodies", "touch.instruments"}
    assert [(key, value, default) for key, value, default in found if value != default and key not in naming] == []
    assert len(found) > 50


def test_the_schema_is_one_in_which_every_key_is_described_and_every_block_closed():
    Draft202012Validator.check_schema(SCHEMA)
    for schema in objects(SCHEMA):
        for key, inner in schema.get("properties", {}).items():
            assert inner.get("description") or SCHEMA["$defs"][inner["$ref"].split("/")[-1]]["description"], key
        if schema.get("type") == "object" and "properties" in schema:
            assert schema["additionalProperties"] is False, schema


def test_defaults_fill_what_is_left_out(smoke):
    given = {key: smoke[key] for key in ("bodies", "regimes")} | {"enrichment": None}
    full = complete(given, Path("config.yaml"))
    assert set(full.given()) == set(SCHEMA["properties"]) - set(STUDIES) | {"enrichment"}
    assert set(full.enrichment.sigma_relative.given()) == {"min", "max", "count"}


def refusal(settings: dict, file: Path = Path("my.yaml")) -> str:
    """Return the one sentence with which settings are refused, without the name of their file."""
    with pytest.raises(InputError) as caught:
        complete(settings, file)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{file}: ")


def put(settings: dict, place: str, value: object) -> None:
    """Put a value at a place, such as bodies.liver.kind; for None, remove what is there."""
    *parents, key = place.split(".")
    for name in parents:
        settings = settings[name]
    settings[key] = value
    if value is None:
        del settings[key]


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("sed", 1, "the file has an unknown key sed; did you mean seed?"),
        ("bodies.liver.poison", 0.3, " has an unknown key poison; did you mean poisson?"),
        ("bodies.liver.poisson", 0.5, "bodies.liver.poisson is 0.5: input should be less than 0.5 (Poisson's ratio)."),
        ("bodies.liver.young_pa", float("nan"), "bodies.liver.young_pa is nan: input should be a finite number"),
        ("bodies.liver.length_m", None, "bodies.liver lacks length_m; add it (Longest side [m])."),
        ("bodies.liver.train", 7, "bodies.liver.train is 7; make it a multiple of the 2 magnitudes,"),
        ("bodies.liver.kind", "livr", "bodies.liver cannot be used: its kind 'livr' found"),
        ("solver.tolerance", "1e-8", ".tolerance is '1e-8': input should be a valid number"),
        ("bodies.liver.refinements", 2, "bodies.liver.paper_surface has 2 entries; give one for each"),
        ("enrichment.sigma_relative.min", 10, "enrichment.sigma_relative.min is 10; make it less than"),
        ("bodies.liver.length_m", 200, ".length_m makes a body 200 m long, and bodies are 0.002 to 5 m long here"),
        ("scenes.poke.step_s", 5, ".step_s is 5, and push.loads[0] lasts"),
        ("springs.young_pa", [3000, 300], "springs.young_pa is [3000, 300]; give the lower number first."),
        ("springs.duration_s", 1e-5, "springs.duration_s is 1e-05, and step_s 0.0004; give the time of one"),
        ("springs.key_points_m", [[0, 0, 0.01], [0, 0, 1]], "[1] is [0, 0, 1], which is outside the cube; give"),
        ("enrichment.regimes", {"small": {"peak_of_size": 0.02}}, "enrichment.regimes.small is under regimes, too;"),
        ("springs.side_m", 0.001, "springs.key_points_m[0] is"),
    ],
)
def test_what_is_wrong_is_said(smoke, place, value, said):
    put(smoke, place, value)
    assert said in refusal(smoke)


def test_what_a_study_needs_is_said(smoke):
    assert refusal({"bodies": smoke["bodies"]}).startswith("nothing is asked for")
    del smoke["bodies"]["abdomen"], smoke["palpation"]
    assert refusal(smoke).startswith("ct is there and no body is of kind ct; add such a body")


def test_scenes_are_completed_down_to_their_loads():
    given = settings_of_full()
    given["scenes"]["clay_dent"]["push"]["loads"][0].pop("hold_s", None)
    given["scenes"]["sheet_drape"]["contact"]["instruments"] = [{"kind": "floor", "height_m": -0.1}]
    scenes = complete(given, ROOT / "config.yaml").scenes
    clay = scenes["clay_dent"]
    assert clay.held is True and clay.start == "rest" and clay.level == 0 and clay.pushes[0].hold_s == 0.5
    assert scenes["sheet_drape"].instruments[0].axis == "z"


BALL = {"kind": "sphere", "center_m": [0, 0, 1], "radius_m": 0.1}


@pytest.mark.parametrize(
    ("tools", "said"),
    [
        ([BALL | {"times_s": [0, 1], "shifts_m": [[0, 0, 0]]}], "[0].times_s has 2 entries, and shifts_m has 1; give"),
        ([BALL, BALL | {"times_s": [0, 2, 1], "shifts_m": [[0, 0, 0]] * 3}], "[1].times_s has 1 after 2; give times"),
        ([BALL | {"name": "a"}, BALL, BALL | {"name": "a"}], "[2] is called a, as instruments[0] is; give"),
        ([BALL | {"name": "bar_1"}], "[0] is called bar_1, as a body is; give"),
    ],
)
def test_what_is_wrong_with_instruments_is_said(tools, said):
    given = settings_of_full()
    given["scenes"]["bar_sag"]["contact"] = {"instruments": tools}
    assert refusal(given).startswith(f"scenes.bar_sag.contact.instruments{said}")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("body", "livr", " names the body livr, which is not under bodies; did you mean liver?"),
        ("own", {"wind": "wind.py"}, ".own.wind is wind.py, where there is no file"),
        ("effects", ["corotational", "gravity"], ".effects is gone: a scene's effects are its blocks"),
        ("plasticity", None, ".plasticity is null"),
        ("seed", 2, ".seed has no use"),
        ("level", 1, ".level is 1, and bar has levels 0 to 0"),
        ("own_settings", {"wind": {}}, ".own_settings names wind, and own does not"),
    ],
)
def test_what_is_wrong_with_a_scene_is_said(key, value, said):
    given = {name: block for name, block in settings_of_full().items() if name in ("bodies", "scenes")}
    given["scenes"]["bar_sag"][key] = value
    assert refusal(given, ROOT / "config.yaml").startswith(f"scenes.bar_sag{said}")


COMMON = {"young_pa": 1e4, "poisson": 0.3, "density_kg_m3": 1000, "anchors": {"nodes": [0, 1, 2]}}
BAR = {"kind": "box", "sizes_m": [0.3, 0.1, 0.1], "divisions": [6, 2, 2], "refinements": 0} | COMMON
CLOTH = {"kind": "sheet", "sizes_m": [0.3, 0.3], "divisions": [6, 6], "thickness_m": 0.001} | COMMON
CT = {"kind": "ct", "refinements": 1} | COMMON
SAMPLES = {"magnitudes": [0.7, 1.3], "train": 8, "test": 6}


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (BAR | {"train": 8, "test": 6}, " lacks magnitudes; give magnitudes, train and test together"),
        (BAR | SAMPLES, ".refinements is 0; give at least 1"),
        (BAR | {"regions": {"a": {"young_pa": 1e5}}}, ".regions.a needs exactly one of tag, sphere and label"),
        (CLOTH | SAMPLES, " has an unknown key magnitudes"),
        (CT | {"image": "none.nii.gz"}, ".image is none.nii.gz, where there is no file; give a path"),
        (CT | {"mask": __file__}, ".mask is given and image is not; give the image that the mask"),
        (CT | {"threshold_hu": [120, 30]}, ".threshold_hu is [120, 30]; give the lower number first."),
        (CT | {"image": __file__, "mask": ""}, ".mask is '': "),
    ],
)
def test_what_is_wrong_with_a_body_is_said(smoke, body, said):
    smoke["bodies"]["new"] = body
    assert refusal(smoke).startswith(f"bodies.new{said}")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"models": ["fem_p2", "fem_p3"]}, " names fem_p3, which is unknown; did you mean fem_p"),
        ({"models": ["detail_correction"]}, ".models lacks fem_p2"),
        ({"bodies": ["livr"]}, " names livr, which is unknown; did you mean liver?"),
        ({"bodies": ["bar"]}, " names bar, which is not refined; give it refinements of at least 1."),
        ({"in_depth": ["bar"]}, ".in_depth names bar, which is unknown; "),
        ({"any_load": {"regimes": ["smal"]}}, ".any_load.regimes names smal, which is unknown"),
    ],
)
def test_what_is_wrong_with_the_trade_off_is_said(trading, changes, said):
    trading["tradeoff"] |= changes
    assert refusal(trading).startswith(f"tradeoff{said}")


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("regimes.small.radius_of_body_m", {"livr": 0.01}, "regimes.small.radius_of_body_m names livr, which is unkn"),
        ("regimes", None, "tradeoff is there and there are no regimes"),
        ("own_models", {"fem_coarse": "mine.py"}, "own_models names fem_coarse, which palpate uses itself"),
        ("own_models", {"mine": "nowhere.py"}, "own_models.mine is nowhere.py, where there is no file"),
        ("bodies.liver", None, "tradeoff is there and no body is refined"),
    ],
)
def test_what_the_trade_off_needs_is_said(trading, place, value, said):
    trading["bodies"] = {name: trading["bodies"][name] for name in ("liver", "bar")}
    trading["tradeoff"] |= {"bodies": None}
    put(trading, place, value)
    assert refusal(trading).startswith(said)


FLOOR = {"contact": {"instruments": [{"kind": "floor", "height_m": -1.0}]}}


@pytest.mark.parametrize(
    ("scene", "asked", "said"),
    [
        ({}, {"nix": {"duration_s": 0.1}}, ".scenes names nix, which is not a scene"),
        (FLOOR, {"mine": {"duration_s": 0.1}}, ".scenes names mine, which has contact; describe"),
        (FLOOR, None, " is there and models can be compared in no scene (mine has contact); add a scene"),
        (
            {},
            {"mine": {"duration_s": 0.1, "elsewhere": {"places": 10}}},
            ".scenes.mine.elsewhere moves the one push of a held body to other places, and the scene has 0 pushes",
        ),
        (
            FLOOR,
            {"mine": {"duration_s": 0.1, "truth": {}, "training": {"duration_s": 0.1}}},
            ".scenes.mine has truth, which is found of held solids alone, and mine is touched by a floor",
        ),
        (
            {},
            {"mine": {"duration_s": 0.1, "truth": {"levels": 2}}},
            ".scenes.mine.truth.levels is 2, and quadratic elements need 3",
        ),
    ],
)
def test_scenes_that_models_cannot_be_compared_in_are_said(scene, asked, said):
    settings = {"bodies": {"bar": small_scene.BAR | {"poisson": 0.3}}}
    settings |= {"scenes": {"mine": small_scene.SCENE | {"body": "bar"} | scene}}
    settings |= {"dynamic": {} if asked is None else {"scenes": asked}}
    assert refusal(settings).startswith(f"dynamic{said}")
