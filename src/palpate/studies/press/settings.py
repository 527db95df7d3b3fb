"""Settings of the page on which bodies are pressed."""

from pathlib import Path
from typing import Any, Literal

from palpate.benchmark.settings import Disc, Instrument, check_instruments, check_refined, pressed_bodies
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Count, Index, Positive, Some, key


class Settings(Disc):
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


def check(config: Any, file: Path) -> None:
    """Raise InputError for bodies that there are not, or that are not refined, and radii of bodies there are not."""
    place, names, settings = f"{file}: press", pressed_bodies(config, "press"), config.press
    check_refined(f"{place}.bodies", names, config.bodies)
    if wrong := describe_unknown(list(settings.radius_of_body_m), list(config.bodies)):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    check_instruments(f"{place}.instruments", settings.instruments, names, config.bodies)
    for i, tool in enumerate(settings.instruments):
        if tool.kind not in ("sphere", "punch") or tool.sticks:
            raise InputError(
                f"{place}.instruments[{i}] is a {tool.kind}{' that sticks' * tool.sticks}; give a sphere or a "
                "punch that slides."
            )
