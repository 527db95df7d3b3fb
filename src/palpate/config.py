"""Check the settings of a run, and report in one sentence what a schema cannot find."""

from importlib import import_module
from importlib.util import find_spec
from os.path import isdir, isfile, normpath
from pathlib import Path

from palpate.errors import InputError
from palpate.files import check_file
from palpate.own_file import LAW_FUNCTIONS, check_source
from palpate.schema import checked, studies

FINGER = "finger_{:.0f}_um"
"""The name of the regime of a finger, by its radius in micrometres."""


def complete(config: dict, schema: dict, file: Path) -> dict:
    """Return ``config`` with the schema's defaults filled in.

    A study may have more to check: ``check(config, file)`` in palpate.studies.<study>.check.
    Raises InputError naming ``file``, the key and the remedy.
    """
    config = checked({key: {} if value is None else value for key, value in config.items()}, schema, file)
    for name, body in config["bodies"].items():
        _check_body(f"{file}: bodies.{name}", body, file.parent)
    asked = asked_for(config, schema)
    if not asked:
        raise InputError(f"{file}: nothing is asked for; add the block of a study: {', '.join(studies(schema))}.")
    for study in asked:
        if find_spec(f"palpate.studies.{study}.check"):
            import_module(f"palpate.studies.{study}.check").check(config, file)
    return config


def asked_for(config: dict, schema: dict) -> list[str]:
    """Return the studies that have a block in ``config``, in the order of the report."""
    return [name for name in studies(schema) if name in config]


def pressed_bodies(config: dict) -> list[str]:
    """Return the names of the bodies that the trade-off presses: those that it names, or all that are refined."""
    if "tradeoff" not in config:
        return []
    named = config["tradeoff"]["bodies"]
    return named or [name for name, body in config["bodies"].items() if body.get("refinements", 0)]


def finger_regimes(config: dict) -> dict[str, dict]:
    """Return a regime for each radius of ``tradeoff.finger_radii_m``, by name: as deep as the first of the regimes.

    The radius of the first regime needs no other one, unless bodies have their own there.
    """
    first = next(iter(config["regimes"].values()))
    known = None if first["radius_of_body_m"] else first["radius_m"]
    radii = [radius for radius in config["tradeoff"]["finger_radii_m"] if radius != known]
    return {FINGER.format(1e6 * radius): first | {"radius_m": radius, "radius_of_body_m": {}} for radius in radii}


def paths_of_body(body: dict, folder: Path) -> dict[str, str]:
    """Return the files or folders that the entry of a body is made from, by key, as they can be opened from here.

    folder : of the settings, from where the entry names them
    """
    keys = [key for key in ("path", "image", "mask", "law") if body.get(key) is not None]
    return {key: normpath(folder / body[key]) for key in keys if key != "law" or body[key].endswith(".py")}


def _check_body(place: str, body: dict, folder: Path) -> None:
    """Raise InputError for what a schema cannot find in one body."""
    keys = ("magnitudes", "train", "test")
    missing = [key for key in keys if key not in body]
    if 0 < len(missing) < len(keys):
        raise InputError(
            f"{place} lacks {missing[0]}; give magnitudes, train and test together, "
            "or none of them for a body that only scenes use."
        )
    if not missing:
        _check_counts(place, body)
    levels = body.get("refinements", 0) + 1
    if len(body.get("paper_surface", range(levels))) != levels:
        raise InputError(
            f"{place}.paper_surface has {len(body['paper_surface'])} entries; "
            f"give one for each of the {levels} levels, or null."
        )
    for key, path in paths_of_body(body, folder).items():
        # only an image may be a folder, of DICOM slices
        check_file(f"{place}.{key}", body[key], isfile(path) or (key == "image" and isdir(path)))
        if key == "law":
            check_source(f"{place}.law", Path(path), LAW_FUNCTIONS, "see docs/add-a-law.md")
    for name, rule in (body.get("regions") or {}).items():
        if sum(kind in rule for kind in ("tag", "sphere", "label")) != 1:
            raise InputError(f"{place}.regions.{name} needs exactly one of tag, sphere and label; give one of them.")
    if body["kind"] == "ct":
        _check_ct(place, body)


def _check_ct(place: str, body: dict) -> None:
    if body["mask"] is not None and body["image"] is None:
        raise InputError(f"{place}.mask is given and image is not; give the image that the mask was drawn on.")
    if body["label"] is not None and body["mask"] is None:
        raise InputError(f"{place}.label is given and mask is not; give the mask that has this label.")
    low, high = body["threshold_hu"]
    if low >= high:
        raise InputError(f"{place}.threshold_hu is [{low:g}, {high:g}]; give the lower number first.")


def _check_counts(place: str, body: dict) -> None:
    """Raise InputError unless whole contacts can be held out, and there is a fine mesh."""
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
