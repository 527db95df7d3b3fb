"""Check of the settings of models in motion."""

from pathlib import Path

from palpate.errors import InputError
from palpate.scenes.scene_check import check_instruments
from palpate.scenes.dynamic_check import acts, check_trial, taught, trials, unable


def check(config: dict, file: Path) -> None:
    """Raise InputError for a scene that is unknown, or on which models cannot be compared, or if there is none."""
    scenes, bodies, asked = config.get("scenes", {}), config["bodies"], config["dynamic"].get("scenes")
    if asked is None:
        _check_any(file, scenes, bodies)
        return
    place = f"{file}: dynamic.scenes"
    for name, own in asked.items():
        if name not in scenes:
            known = ", ".join(scenes) or "there are none"
            raise InputError(f"{place} names {name}, which is not a scene; choose from scenes: {known}.")
        entry, body = scenes[name], bodies.get(scenes[name]["body"], {})
        check_trial(place, name, entry, body.get("kind", ""), taught(own))
        for model in own.get("models") or []:
            if reason := unable(model, entry, body.get("kind", "")):
                raise InputError(
                    f"{place}.{name}.models names {model}, which cannot do it, as {name} {reason}; leave it out."
                )
        _check_training(f"{place}.{name}.training", entry, own.get("training", {}))
        if "elsewhere" in own:
            _check_elsewhere(f"{place}.{name}.elsewhere", entry, bodies.get(entry["body"], {}).get("kind", ""))


def _check_training(place: str, entry: dict, training: dict) -> None:
    """Raise InputError, naming ``place``, for a motion that models cannot be fitted to."""
    for name in training:
        if name not in ("duration_s", "others") and name not in entry:
            raise InputError(f"{place} describes {name}, which the scene has not; leave it out.")
    if any(other["body"] != entry["body"] for other in training.get("others", [])):
        raise InputError(f"{place}.others names another body than {entry['body']}; name that one.")
    check_instruments(place, entry | {"contact": training.get("contact", {})})


def _check_elsewhere(place: str, entry: dict, kind: str) -> None:
    """Raise InputError, naming ``place``, for a scene without one push, or one that models cannot be asked in."""
    pushes = len(entry.get("push", {}).get("loads", [])) if acts("push", entry, kind) else 0
    reason = unable("moving_modes", entry, kind) or ("" if pushes == 1 else f"has {pushes} pushes")
    if reason:
        raise InputError(
            f"{place} moves the one push of a held body to other places, and the scene {reason}; leave it out."
        )


def _check_any(file: Path, scenes: dict, bodies: dict) -> None:
    known = {name: entry for name, entry in scenes.items() if entry["body"] in bodies}  # of others the scenes' check
    found, left_out = trials(known, bodies)
    if not found:
        reasons = "; ".join(f"{name} {reason}" for name, reason in left_out.items()) or "there is no scene"
        raise InputError(
            f"{file}: dynamic is there and models can be compared in no scene ({reasons}); "
            "add a scene of one held body with gravity or push and without contact, or remove dynamic."
        )
