"""Check of the settings of models in motion."""

from pathlib import Path

from palpate.errors import InputError
from palpate.scenes.dynamic_check import check_trial, trials


def check(config: dict, file: Path) -> None:
    """Raise InputError for a scene that is unknown, or on which models cannot be compared, or if there is none."""
    scenes, bodies, durations = config.get("scenes", {}), config["bodies"], config["dynamic"].get("durations_s")
    if durations is None:
        _check_any(file, scenes, bodies)
        return
    place = f"{file}: dynamic.durations_s"
    for name in durations:
        if name not in scenes:
            known = ", ".join(scenes) or "there are none"
            raise InputError(f"{place} names {name}, which is not a scene; choose from scenes: {known}.")
        check_trial(place, name, scenes[name], bodies.get(scenes[name]["body"], {}).get("kind", ""))


def _check_any(file: Path, scenes: dict, bodies: dict) -> None:
    known = {name: entry for name, entry in scenes.items() if entry["body"] in bodies}  # of others the scenes' check
    found, left_out = trials(known, bodies)
    if not found:
        reasons = "; ".join(f"{name} {reason}" for name, reason in left_out.items()) or "there is no scene"
        raise InputError(
            f"{file}: dynamic is there and models can be compared in no scene ({reasons}); "
            "add a scene of one held body with gravity or push and without contact, or remove dynamic."
        )
