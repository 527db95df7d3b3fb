"""Check the settings of a run against their schema, and say in one sentence what is wrong with them."""

import math
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path

from palpate.errors import InputError
from palpate.models import registry as models
from palpate.scenes.instruments import bodies_in, check_instruments
from palpate.scenes.registry import unknown
from palpate.scenes.trial_entry import check_trial


def complete(config: dict, schema: dict, file: Path) -> dict:
    """``config`` with the schema's defaults filled in; InputError naming ``file``, the key and the remedy."""
    from jsonschema import Draft202012Validator

    validator = Draft202012Validator(schema)
    for key, value in _leaves(config):
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{file}: {key} is {value}; give a finite number.")
    for error in sorted(validator.iter_errors(config), key=lambda error: len(error.absolute_path)):
        raise InputError(f"{file}: {_explain(error, schema)}")
    config = _fill(config, schema, schema)
    sigma = config["enrichment"]["sigma_relative"]
    if sigma["min"] >= sigma["max"]:
        raise InputError(
            f"{file}: enrichment.sigma_relative.min is {sigma['min']}; make it less than max, {sigma['max']}."
        )
    for name, body in config["bodies"].items():
        _check_body(f"{file}: bodies.{name}", body, file.parent)
    for name, scene in config["scenes"].items():
        _check_scene(f"{file}: scenes.{name}", scene, config, file.parent)
    _check_papers(file, config)
    if "tradeoff" in config:
        _check_tradeoff(f"{file}: tradeoff", config, file.parent)
    if "dynamic" in config:
        _check_dynamic(f"{file}: dynamic.durations_s", config)
    return config


STUDIES = ("tradeoff", "dynamic", "hard_cases", "scaling")
"""Comparisons that are made if the config has their block."""


def _check_papers(file: Path, config: dict) -> None:
    """Whether what is asked for has what it needs."""
    studies = [name for name in STUDIES if name in config]
    asked = config["papers"] or config["scenes"] or studies
    if not (asked or any(body["kind"] == "ct" for body in config["bodies"].values())):
        raise InputError(
            f"{file}: nothing is asked for; name a paper in papers, describe a scene in scenes, add one of "
            f"{', '.join(STUDIES)}, or a body from CT."
        )
    if "springs" in config["papers"]:
        _check_calibration(f"{file}: calibration", config["calibration"])
    for what, wanted in (
        ("papers names enrichment", "enrichment" in config["papers"]),
        ("tradeoff is there", "tradeoff" in config),
    ):
        if wanted and not config.get("regimes"):
            raise InputError(f"{file}: {what} and there are no regimes; add one that says how hard.")
        if wanted and not any("train" in body for body in config["bodies"].values()):
            raise InputError(f"{file}: {what} and no body has train and test; give a body both.")


def _check_dynamic(place: str, config: dict) -> None:
    for name in config["dynamic"]["durations_s"]:
        if name not in config["scenes"]:
            known = ", ".join(config["scenes"]) or "there are none"
            raise InputError(f"{place} names {name}, which is no scene; choose from scenes: {known}.")
        check_trial(place, name, config["scenes"][name])


def _check_tradeoff(place: str, config: dict, folder: Path) -> None:
    names, own = config["tradeoff"]["models"], config["tradeoff"]["own_models"]
    if wrong := models.unknown(names or [], own):
        raise InputError(f"{place} names {wrong}")
    if names is not None and models.SAVED_AGAINST not in names:
        raise InputError(
            f"{place}.models lacks {models.SAVED_AGAINST}, which is what the others save time against; add it."
        )
    for name, path in own.items():
        if not (folder / path).is_file():
            raise InputError(
                f"{place}.own_models.{name} is {path}, where there is no file; "
                "give a path relative to the folder of the config file."
            )


def _check_scene(place: str, scene: dict, config: dict, folder: Path) -> None:
    for body in bodies_in(scene):
        if body not in config["bodies"]:
            known = ", ".join(config["bodies"]) or "none"
            raise InputError(f"{place} names the body {body}, and bodies knows {known}; name one of them, or add it.")
    if isinstance(scene["effects"], str) and scene["effects"] != "auto":
        raise InputError(f"{place}.effects is {scene['effects']!r}; write auto, or a list of names in brackets.")
    named = [] if scene["effects"] == "auto" else scene["effects"]
    own = scene.get("own", {})
    if wrong := unknown(named, own):
        raise InputError(f"{place}.{wrong}")
    for name in scene.get("own_settings", {}):
        if name not in own:
            raise InputError(f"{place}.own_settings names {name}, and own does not; add its file there, or remove it.")
    for body in bodies_in(scene):
        finest = config["bodies"][body].get("refinements", 0)
        if scene["level"] > finest:
            raise InputError(f"{place}.level is {scene['level']}, and {body} has levels 0 to {finest}.")
    check_instruments(place, scene)
    tools = scene.get("contact", {}).get("instruments", [])
    files = {f"own.{name}": path for name, path in own.items()}
    files |= {f"contact.instruments[{i}].file": tool["file"] for i, tool in enumerate(tools) if "file" in tool}
    for name, path in files.items():
        if not (folder / path).is_file():
            raise InputError(
                f"{place}.{name} is {path}, where there is no file; "
                "give a path relative to the folder of the config file."
            )


def _check_body(place: str, body: dict, folder: Path) -> None:
    """What a schema cannot say."""
    keys = ("magnitudes", "train", "test")
    missing = [key for key in keys if key not in body]
    if 0 < len(missing) < len(keys):
        raise InputError(
            f"{place} lacks {missing[0]}; give magnitudes, train and test together, "
            "or none of them for a body that only scenes use."
        )
    if not missing:
        _check_samples(place, body)
    levels = body.get("refinements", 0) + 1
    if len(body.get("paper_surface", range(levels))) != levels:
        raise InputError(
            f"{place}.paper_surface has {len(body['paper_surface'])} entries; "
            f"give one for each of the {levels} levels, or null."
        )
    for key in ("path", "image", "mask"):
        # only an image may be a folder, of DICOM slices
        found = body.get(key) is None or (folder / body[key]).is_file()
        if not found and not (key == "image" and (folder / body[key]).is_dir()):
            raise InputError(
                f"{place}.{key} is {body[key]}, where there is no file; "
                "give a path relative to the folder of the config file."
            )
    if body["kind"] == "ct":
        _check_ct(place, body)


def _check_ct(place: str, body: dict) -> None:
    if body["mask"] is not None and body["image"] is None:
        raise InputError(f"{place}.mask is given and image is not; give the image that the mask was drawn on.")
    low, high = body["threshold_hu"]
    if low >= high:
        raise InputError(f"{place}.threshold_hu is [{low:g}, {high:g}]; give the lower number first.")


def _check_calibration(place: str, calibration: dict) -> None:
    """What would else be found only when the springs are simulated."""
    low, high = calibration["young_pa"]
    if low >= high:
        raise InputError(f"{place}.young_pa is [{low:g}, {high:g}]; give the lower number first.")
    duration, step = calibration["duration_s"], calibration["step_s"]
    if duration < step:
        raise InputError(
            f"{place}.duration_s is {duration:g}, and step_s {step:g}; give the time of one step at least."
        )
    side = calibration["side_m"]
    for number, point in enumerate(calibration["key_points_m"]):
        if not all(0 <= coordinate <= side for coordinate in point):
            raise InputError(
                f"{place}.key_points_m[{number}] is {point}, which is outside the cube; "
                f"give coordinates from 0 to side_m, {side:g}."
            )


def _check_samples(place: str, body: dict) -> None:
    magnitudes = len(body["magnitudes"])
    for key in ("train", "test"):
        if body[key] % magnitudes:
            raise InputError(
                f"{place}.{key} is {body[key]}; make it a multiple of the {magnitudes} magnitudes, "
                "so that whole contacts can be held out."
            )
    if body["refinements"] < 1:
        raise InputError(
            f"{place}.refinements is 0; give at least 1, because samples compare a coarse mesh with a fine one, "
            "or leave out magnitudes, train and test."
        )


def _leaves(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _leaves(inner, f"{key}[{i}]")
    else:
        yield key, value


def _resolve(schema: dict, root: dict, value: object) -> dict:
    """Follow ``$ref`` and the ``if``/``then`` branches that ``value`` takes to one flat schema."""
    from jsonschema import Draft202012Validator

    flat = dict(schema)
    if "$ref" in schema:
        flat |= root["$defs"][schema["$ref"].rpartition("/")[2]]
    for branch in flat.get("allOf", []):
        if Draft202012Validator(branch["if"]).is_valid(value):
            flat |= _resolve(branch["then"], root, value)
    return flat


def _fill(value: object, schema: dict, root: dict) -> object:
    schema = _resolve(schema, root, value)
    if isinstance(value, list):
        return [_fill(item, schema.get("items", {}), root) for item in value]
    if not isinstance(value, dict):
        return value
    properties = schema.get("properties", {})
    filled = {key: inner["default"] for key, inner in properties.items() if "default" in inner} | value
    others = schema.get("additionalProperties") or {}
    return {key: _fill(inner, properties.get(key, others), root) for key, inner in filled.items()}


def _explain(error, root: dict) -> str:
    """One sentence for a jsonschema error: the key, what is wrong, the remedy."""
    key = error.json_path.removeprefix("$").removeprefix(".") or "the file"
    rule, wanted, found = error.validator, error.validator_value, error.instance
    if rule == "additionalProperties":
        return _unknown(key, found, error.schema["properties"])
    if rule == "required":
        missing = next(name for name in wanted if name not in found)
        known = _resolve(error.schema, root, found).get("properties", {})
        meaning = _resolve(known.get(missing, {}), root, None).get("description", "").rstrip(".")
        return f"{key} lacks {missing}; add it" + (f" ({meaning})." if meaning else ".")
    meaning = error.schema.get("description", "").rstrip(".")
    about = f" ({meaning})." if meaning else "."
    if "pattern" in error.schema:
        return f"{key} has an entry {found!r}; name it in lower-case letters, digits and underscores."
    if rule == "type" and isinstance(found, str) and _is_number(found):
        return f"{key} is the text {found!r}; write the number with a decimal point, like 1.0e-8{about}"
    told = {
        "type": f"must be of type {' or '.join(wanted) if isinstance(wanted, list) else wanted}",
        "enum": f"must be one of {', '.join(map(str, wanted)) if isinstance(wanted, list) else wanted}",
        "minimum": f"must be at least {wanted}",
        "maximum": f"must be at most {wanted}",
        "exclusiveMinimum": f"must be above {wanted}",
        "exclusiveMaximum": f"must be below {wanted}",
        "minItems": f"must have at least {wanted} entries",
        "maxItems": f"must have at most {wanted} entries",
        "minProperties": f"must have at least {wanted} entry",
        "maxProperties": f"must have only {wanted} entry",
        "minLength": "must not be empty",
        "uniqueItems": "must not name one thing twice",
    }
    return f"{key} is {found!r}, but {told.get(rule, error.message)}{about}"


def _unknown(key: str, found: dict, known: dict) -> str:
    name = next(name for name in found if name not in known)
    near = get_close_matches(str(name), known, n=1)
    remedy = f"did you mean {near[0]}?" if near else f"it knows {', '.join(known)}."
    return f"{key} has an unknown key {name}; {remedy}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
