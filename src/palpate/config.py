"""Check the settings of a run, and say in one sentence what is wrong with them that a schema cannot say."""

from pathlib import Path

from palpate.errors import InputError
from palpate.models import model_registry as models
from palpate.scenes.dynamic_check import check_trial
from palpate.scenes.effect_registry import unknown
from palpate.scenes.instruments import bodies_in, check_instruments
from palpate.schema import checked

STUDIES = ("tradeoff", "dynamic", "hard_cases", "scaling")
"""Comparisons that are made if the config has their block."""


def complete(config: dict, schema: dict, file: Path) -> dict:
    """``config`` with the schema's defaults filled in; InputError naming ``file``, the key and the remedy."""
    config = checked(config, schema, file)
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


def _check_file(place: str, path: str, there: bool) -> None:
    if not there:
        raise InputError(
            f"{place} is {path}, where there is no file; give a path relative to the folder of the config file."
        )


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
        _check_file(f"{place}.own_models.{name}", path, (folder / path).is_file())


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
        _check_file(f"{place}.{name}", path, (folder / path).is_file())


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
        if body.get(key) is not None:
            path = folder / body[key]
            # only an image may be a folder, of DICOM slices
            _check_file(f"{place}.{key}", body[key], path.is_file() or (key == "image" and path.is_dir()))
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
