"""Check of the settings of the page on which bodies are pressed."""

from pathlib import Path

from palpate.errors import InputError, describe_unknown


def pressed_here(config: dict) -> list[str]:
    """Return the names of the bodies to press: those that are given, or all that are refined."""
    named = config["press"]["bodies"]
    return named or [name for name, body in config["bodies"].items() if body.get("refinements", 0)]


def radius_of(config: dict, body: str) -> float:
    """Return the radius [m] of the finger on a body."""
    return float(config["press"]["radius_of_body_m"].get(body, config["press"]["radius_m"]))


def check(config: dict, file: Path) -> None:
    """Raise InputError for bodies that there are not, or that are not refined, and radii of bodies there are not."""
    place, names = f"{file}: press", pressed_here(config)
    for key, given in (("bodies", names), ("radius_of_body_m", list(config["press"]["radius_of_body_m"]))):
        if wrong := describe_unknown(given, list(config["bodies"])):
            raise InputError(f"{place}.{key} names {wrong}")
    for name in names:
        if not config["bodies"][name].get("refinements"):
            raise InputError(f"{place}.bodies names {name}, which is not refined; give it refinements of at least 1.")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
