"""Decide which effects act in a scene: those that it lists or, with ``effects: auto``, those that it calls for.

The check of settings, the digest of code and the run decide here. Before a body is made, what depends on it is assumed:
that nodes are anchored, that it has mass, and that springs need the effect volume.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from palpate.bodies.material import LAWS
from palpate.errors import InputError
from palpate.scenes.effect_registry import DAMPINGS, EFFECTS, ELASTIC, INTEGRATORS, of_law

MOVING = ("gravity", "push", "hooks", "threads", "contact")
"""Effects that set a body in motion."""
SPRING_POISSON = 0.25
"""Poisson's ratio of a spring network (Kot and Nagahashi): to reach a higher one, it needs the effect volume."""


class Decision(NamedTuple):
    """An effect, whether a scene calls for it, and the reason."""

    effect: str
    called: bool
    reason: str


@dataclass(frozen=True)
class Moved:
    """What decides on effects of the bodies that a scene moves.

    form : one of FORMS; anchored : number of anchored nodes
    """

    form: str
    law: str = LAWS[0]
    bedded: bool = False
    anchored: float = np.inf
    mass_kg: float = np.inf
    poisson: float = np.inf
    thickness_m: float = 0.0


def assumed(entry: Mapping[str, Any], body: Mapping[str, Any]) -> Moved:
    """Return what the entries of a scene and of its body say before the body is made."""
    form = "sheet" if body.get("kind") == "sheet" else "surface" if entry.get("surface") else "solid"
    return Moved(form, body.get("law", LAWS[0]), bool(body.get("bed")))


def acting(entry: Mapping[str, Any], moved: Moved, place: str = "") -> list[str]:
    """Return the names of the effects that act in a scene, with ``effects: auto`` the elastic one first.

    entry : the scene's, complete; place : its name in messages
    Raises InputError if ``effects: auto`` finds two elastic effects described.
    """
    if (listed := entry.get("effects", "auto")) != "auto":
        return list(listed)
    return [decision.effect for decision in decide(entry, moved, place) if decision.called]


def modules(entry: Mapping[str, Any], moved: Moved) -> list[str]:
    """Return the modules of the effects and of the integrator that a scene imports by name."""
    effects = [EFFECTS[name].module for name in acting(entry, moved) if name in EFFECTS]
    return [*dict.fromkeys(effects), INTEGRATORS[entry["integrator"]]]


def has_contact(entry: Mapping[str, Any]) -> bool:
    """Return whether contact acts in a scene."""
    return "contact" in acting(entry, Moved("solid"))


def has_forces(entry: Mapping[str, Any]) -> bool:
    """Return whether forces are told of a scene: contact, hooks or threads act."""
    return has_contact(entry) or has_hooks_or_threads(entry)


def has_hooks_or_threads(entry: Mapping[str, Any]) -> bool:
    return not {"hooks", "threads"}.isdisjoint(acting(entry, Moved("solid")))


def has_driven(entry: Mapping[str, Any]) -> bool:
    """Return whether an instrument that can be met moves before a scene's end, or hooks or threads act in it."""
    if not has_contact(entry) or has_hooks_or_threads(entry):
        return has_hooks_or_threads(entry)
    for tool in entry.get("contact", {}).get("instruments", []):
        places = zip(tool.get("times_s", []), tool.get("shifts_m", []), strict=True)
        if any(a < entry["duration_s"] and b > 0.0 and here != there for (a, here), (b, there) in pairwise(places)):
            return True
    return False


def decide(entry: Mapping[str, Any], moved: Moved, place: str = "") -> list[Decision]:
    """Return the decision of ``effects: auto`` on every effect there is, the elastic ones first.

    Raises InputError, beginning with ``place``, if the scene describes two elastic effects.
    """
    elastic, why = _elastic(entry, moved, place)
    decisions = [Decision(elastic, True, why)]
    decisions += [Decision(name, False, f"{elastic} holds the body together") for name in ELASTIC if name != elastic]
    for name, effect in EFFECTS.items():
        if effect.role == "other":
            decisions.append(Decision(name, *_other(name, entry, moved, elastic)))
    own = entry.get("own", {})
    moves = [d.effect for d in decisions if d.called and d.effect in MOVING] + list(own)
    if (start := entry.get("start", "rest")) != "rest":
        moves.append(f"the start, {start}")
    decisions += _dampings(entry, elastic, moves)
    return decisions + [Decision(name, True, "a file of the scene's own") for name in own]


def _elastic(entry: Mapping[str, Any], moved: Moved, place: str) -> tuple[str, str]:
    described = [name for name in ("springs", "shape_matching") if name in entry]
    if len(described) > 1:
        raise InputError(f"{place} describes both springs and shape_matching; keep one of them, or name the effects.")
    if described:
        return described[0], "the scene describes it"
    return {
        "sheet": ("triangles", "the body is a sheet"),
        "solid": (of_law(moved.law), "the body is made of tetrahedra"),
        "surface": ("springs", "the particles are a surface without an inside"),
    }[moved.form]


def _other(name: str, entry: Mapping[str, Any], moved: Moved, elastic: str) -> tuple[bool, str]:
    """Return whether an effect that is neither elastic nor a damping is called, and the reason."""
    match name:
        case "gravity":
            acceleration = entry.get("gravity", {}).get("acceleration_m_s2", [0, 0, 0])
            if not np.any(acceleration):
                return False, "no acceleration is given"
            if not moved.mass_kg:
                return False, "the body has no mass"
            return True, f"{np.linalg.norm(acceleration):.3g} m/s² act on {moved.mass_kg:.3g} kg"
        case "held" | "bed" if not entry.get("held", True):
            return False, "the scene lets the body go"
        case "held":
            if not moved.anchored:
                return False, "no node of these particles is anchored"
            return True, f"{moved.anchored} nodes are anchored"
        case "bed":
            return moved.bedded, "the body lies on an elastic bed" if moved.bedded else "no body has a bed"
        case "push":
            loads = [load for load in entry.get("push", {}).get("loads", []) if np.any(load["force_n"])]
            return bool(loads), f"loads that push: {len(loads)}" if loads else "nothing pushes"
        case "bending":
            if elastic == "triangles":
                return True, f"the sheet is {1e3 * moved.thickness_m:g} mm thick"
            return False, "only triangles lack a resistance to bending"
        case "volume":
            if elastic != "springs" or moved.form != "solid":
                return False, f"{elastic} keeps what volume it should, or there is none to keep"
            if moved.poisson <= SPRING_POISSON and "volume" not in entry:
                return False, f"a spring network has Poisson's ratio 1/4 by itself, {moved.poisson:g} is asked"
            return True, f"springs alone would lose volume: Poisson's ratio {moved.poisson:g} is asked, 1/4 given"
        case "body_springs":
            if elastic == "springs" and moved.form == "surface":
                return True, "a closed surface of springs has no inside that resists"
            return False, "the body resists by itself"
        case "contact":
            settings = entry.get("contact", {})
            if instruments := settings.get("instruments", []):
                return True, f"instruments that the body can meet: {len(instruments)}"
            if others := entry.get("others", []):
                return True, f"bodies that can meet each other: {1 + len(others)}"
            if settings.get("self_contact"):
                return True, "the scene says that the body can meet itself"
            return False, "there is one body and nothing that it can meet"
        case "plasticity":
            if entry.get("plasticity", {}).get("max_strain", 0) > 0:
                return True, f"the body yields above {entry['plasticity']['yield_strain']:g}"
            return False, "the body does not yield"
    return name in entry, "the scene describes it" if name in entry else "the scene does not describe it"


def _dampings(entry: Mapping[str, Any], elastic: str, moves: list[str]) -> list[Decision]:
    if not moves:
        return [Decision(name, False, "nothing moves the body") for name in DAMPINGS]
    described = [name for name in DAMPINGS if name in entry]
    suits = described or [EFFECTS[elastic].damping]
    suited = "the scene describes it" if described else f"suits {elastic}"
    why = f"the body moves ({', '.join(moves)}); {suited}"
    return [Decision(name, name in suits, why if name in suits else f"{suits[0]} damps it") for name in DAMPINGS]
