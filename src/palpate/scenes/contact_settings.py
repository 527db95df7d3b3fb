"""Read the contact in a scene's entry before anything is made of it: names, paths, and whether it acts."""

import re
from itertools import pairwise

from palpate.errors import InputError


def bodies_in(scene: dict) -> list[str]:
    """Return the names of all bodies in a scene's entry, its own first."""
    return [scene["body"], *(other["body"] for other in scene.get("others", []))]


def check_instruments(place: str, scene: dict) -> None:
    """Raise InputError, naming ``place``, unless each path is complete and each name is different."""
    # the name that contact gives to the body, to its pieces, or to several bodies together
    together = re.escape(", ".join(dict.fromkeys(bodies_in(scene))))
    first: dict[str, str] = {}
    for number, tool in enumerate(_instruments(scene)):
        where = f"{place}.contact.instruments[{number}]"
        _check_path(where, tool.get("times_s", []), tool.get("shifts_m", []))
        name = tool.get("name", f"{tool['kind']}_{number}")
        if re.fullmatch(rf"{together}(_\d+)?", name):
            raise InputError(f"{where} is called {name}, as a body is; give it a name of its own.")
        if name in first:
            raise InputError(f"{where} is called {name}, as {first[name]} is; give it a name of its own.")
        first[name] = f"instruments[{number}]"


def _check_path(where: str, times: list[float], shifts: list[list[float]]) -> None:
    if len(times) != len(shifts):
        raise InputError(
            f"{where}.times_s has {len(times)} entries, and shifts_m has {len(shifts)}; give one shift for each time."
        )
    for earlier, later in pairwise(times):
        if later <= earlier:
            raise InputError(f"{where}.times_s has {later:g} after {earlier:g}; give times in increasing order.")


def has_contact(scene: dict) -> bool:
    """Return whether contact acts in a scene, given its complete entry."""
    if scene["effects"] != "auto":
        return "contact" in scene["effects"]
    contact = scene.get("contact", {})
    return bool(contact.get("instruments") or contact.get("self_contact") or scene.get("others"))


def has_moving_instrument(scene: dict) -> bool:
    """Return whether contact acts in a scene and an instrument moves before its end."""
    return has_contact(scene) and any(_moves(tool, scene["duration_s"]) for tool in _instruments(scene))


def _moves(tool: dict, duration: float) -> bool:
    places = list(zip(tool.get("times_s", []), tool.get("shifts_m", []), strict=True))
    return any(a < duration and b > 0.0 and here != there for (a, here), (b, there) in pairwise(places))


def _instruments(scene: dict) -> list[dict]:
    return scene.get("contact", {}).get("instruments", [])
