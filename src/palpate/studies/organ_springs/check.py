"""Check of the settings of paper 2's chain for an organ."""

from pathlib import Path

from palpate.errors import InputError, suggest


def check(config: dict, file: Path) -> None:
    """Raise InputError for bodies that are not there or are sheets, none at all, and settings that do not fit."""
    place, settings = f"{file}: organ_springs", config["organ_springs"]
    able = [name for name, body in config["bodies"].items() if body["kind"] != "sheet"]
    chosen = settings["bodies"] or [name for name in able if config["bodies"][name]["kind"] == "ct"]
    if not chosen:
        raise InputError(f"{place} is there and no body is of kind ct; name one in organ_springs.bodies, or remove it.")
    for name in chosen:
        if name not in able:
            raise InputError(f"{place}.bodies names {name}, which is no solid body; {suggest(name, able, 'name')}")
    rise, duration = settings["rise_s"], settings["duration_s"]
    if rise > duration:
        raise InputError(
            f"{place}.rise_s is {rise:g} s, and motions end after duration_s, {duration:g} s, before the force is "
            "there; lower rise_s, or give a longer duration_s."
        )
    low, high = settings["young_of_body"]
    if low >= high:
        raise InputError(f"{place}.young_of_body is [{low:g}, {high:g}]; give the lower number first.")
    for every in settings["fem_frames"]:
        if settings["frames"] % every:
            raise InputError(
                f"{place}.fem_frames has {every}, which does not divide frames, {settings['frames']}; "
                "change one of them."
            )
