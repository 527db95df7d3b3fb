"""Check of the settings of the trade-off between accuracy and time."""

import re
from pathlib import Path

from palpate.config import FINGER, pressed_bodies
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.models import model_registry
from palpate.own_file import MODEL_FUNCTIONS, check_source


def check(config: dict, file: Path) -> None:
    """Raise InputError for unknown or missing models, or nothing to sample."""
    place, names, own = f"{file}: tradeoff", config["tradeoff"]["models"], config["tradeoff"]["own_models"]
    if wrong := model_registry.unknown(names or [], own):
        raise InputError(f"{place} names {wrong}")
    if names is not None and model_registry.SAVED_AGAINST not in names:
        raise InputError(
            f"{place}.models lacks {model_registry.SAVED_AGAINST}, which is what the others save time against; add it."
        )
    stages = [stage["model"] for stage in config["tradeoff"]["settings"]["cascade"]["stages"]]
    if wrong := model_registry.unknown(stages, {}) or describe_unknown(stages, _staged()):
        raise InputError(f"{place}.settings.cascade.stages names {wrong}")
    _check_models(f"{place}.training_contacts_of", config["tradeoff"]["training_contacts_of"], own)
    for name, path in own.items():
        check_file(f"{place}.own_models.{name}", path, (file.parent / path).is_file())
        check_source(f"{place}.own_models.{name}", file.parent / path, MODEL_FUNCTIONS, "see docs/add-a-model.md")
    _check_bodies(file, config)
    for block in ("any_load", "beyond_design"):
        _check_asked(file, config, block)


def _staged() -> list[str]:
    """List the models that may be a stage of a cascade."""
    return [name for name in model_registry.MODELS if name != "cascade"]


def _check_asked(file: Path, config: dict, block: str) -> None:
    """Raise InputError for models, bodies and regimes of a ``block`` that there are not, or no regular expression."""
    asked, place = config["tradeoff"][block], f"{file}: tradeoff.{block}"
    if asked is None:
        return
    _check_models(f"{place}.models", asked["models"], config["tradeoff"]["own_models"])
    for key, known in (("bodies", pressed_bodies(config)), ("regimes", list(config["regimes"]))):
        if wrong := describe_unknown(asked[key] or [], known):
            raise InputError(f"{place}.{key} names {wrong}")


def _check_models(place: str, patterns: dict[str, str], own: dict) -> None:
    """Raise InputError for models that there are not, and for patterns of their settings that are none."""
    if wrong := model_registry.unknown(list(patterns), own):
        raise InputError(f"{place} names {wrong}")
    for name, pattern in patterns.items():
        try:
            re.compile(pattern)
        except re.error as error:
            raise InputError(f"{place}.{name}: {pattern} is no regular expression ({error}).") from error


def _check_bodies(file: Path, config: dict) -> None:
    """Raise InputError for bodies that cannot be pressed, or that nothing presses."""
    if not config.get("regimes"):
        raise InputError(f"{file}: tradeoff is there and there are no regimes; add one that says how hard to press.")
    pressed = config["tradeoff"]["limit_points"] or {}
    for name in [*(config["tradeoff"]["bodies"] or []), *filter(None, [pressed.get("body")])]:
        if name not in config["bodies"]:
            raise InputError(f"{file}: tradeoff names {describe_unknown([name], list(config['bodies']))}")
        if not config["bodies"][name].get("refinements"):
            raise InputError(f"{file}: tradeoff names {name}, which is not refined; give it refinements of at least 1.")
    if not pressed_bodies(config):
        raise InputError(f"{file}: tradeoff is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(config["tradeoff"]["in_depth"] or [], pressed_bodies(config)):
        raise InputError(f"{file}: tradeoff.in_depth names {wrong}")
    fingers = {FINGER.format(1e6 * radius) for radius in config["tradeoff"]["finger_radii_m"]}
    for name, regime in config["regimes"].items():
        if name in fingers:
            raise InputError(f"{file}: regimes.{name} has the name of a regime of finger_radii_m; give it another.")
        if wrong := describe_unknown(list(regime["radius_of_body_m"]), list(config["bodies"])):
            raise InputError(f"{file}: regimes.{name}.radius_of_body_m names {wrong}")
