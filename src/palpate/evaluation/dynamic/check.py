"""Check of the settings of models in motion."""

from pathlib import Path

from palpate.errors import InputError
from palpate.scenes.dynamic_check import check_trial


def check(config: dict, file: Path) -> None:
    """Raise InputError for a scene that is unknown, or on which models cannot be compared."""
    place, scenes = f"{file}: dynamic.durations_s", config.get("scenes", {})
    for name in config["dynamic"]["durations_s"]:
        if name not in scenes:
            known = ", ".join(scenes) or "there are none"
            raise InputError(f"{place} names {name}, which is not a scene; choose from scenes: {known}.")
        check_trial(place, name, scenes[name])
