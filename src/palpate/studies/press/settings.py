"""Settings of the page on which bodies are pressed."""

from pathlib import Path
from typing import Literal

from palpate.benchmark.settings import Instrument, check_instruments, check_refined, pressed_bodies
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Block, Count, Index, Positive, Some, key


class Settings(Block):
    """A page on which a reader presses bodies: a prepared model in it answers, and says its error."""

    bodies: Some[str] | None = key("Bodies to press, by name; null takes all that are refined", None)
    contacts: Count = key("Contacts that the model is prepared for; between them it answers from the nearest", 24)
    modes: Literal["columns", "snapshots"] = key(
        "Contact modes of simulated presses (snapshots) or linear ones (columns)", "columns"
    )
    thinned: Positive = key("To what relative error of the reduced forces the cells are thinned", 0.003)
    samples: Index = key("Presses of the trade-off by the same finger whose truth the page can show, at most", 6)
    instruments: list[Instrument] = key("Spheres and punches that the page offers beside the finger, at places", [])
    places: Count = key("Places that are prepared for each instrument, in about 15 s each", 3)
    radius_m: Positive = key("Radius [m] of the finger's patch", 0.03)
    radius_of_body_m: dict[str, Positive] = key("Other radii [m], by the names of bodies", {})


def check(config: dict, file: Path) -> None:
    """Raise InputError for bodies that there are not, or that are not refined, and radii of bodies there are not."""
    place, names = f"{file}: press", pressed_bodies(config, "press")
    check_refined(f"{place}.bodies", names, config)
    if wrong := describe_unknown(list(config["press"]["radius_of_body_m"]), list(config["bodies"])):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    check_instruments(f"{place}.instruments", config["press"]["instruments"], names, config)
    for i, entry in enumerate(config["press"]["instruments"]):
        if entry["kind"] not in ("sphere", "punch") or entry["sticks"]:
            raise InputError(
                f"{place}.instruments[{i}] is a {entry['kind']}{' that sticks' * entry['sticks']}; give a sphere or a "
                "punch that slides."
            )
