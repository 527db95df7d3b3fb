"""Decide which effects act in a scene: its blocks, what holds its bodies together, and what holds them in place.

The check of settings, the digest of code and the run decide here. Before a body is made, what depends on it is assumed:
that nodes are anchored.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from palpate.bodies.material import LAWS
from palpate.bodies.settings import Body
from palpate.scenes.effect_registry import EFFECTS, ELASTIC, INTEGRATORS, of_law
from palpate.scenes.settings import Scene

SPRING_POISSON = 0.25
"""Poisson's ratio of a spring network (Kot and Nagahashi): to reach a higher one, it needs the effect volume."""


class Decision(NamedTuple):
    """An effect, whether it acts in a scene, and the reason."""

    effect: str
    acts: bool
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


def assumed(scene: Scene, body: Body) -> Moved:
    """Return what the settings of a scene and of its body say before the body is made."""
    form = "sheet" if body.kind == "sheet" else "surface" if scene.surface else "solid"
    return Moved(form, getattr(body, "law", None) or LAWS[0], getattr(body, "bed", None) is not None)


def acting(scene: Scene, moved: Moved) -> list[str]:
    """Return the names of the effects that act in a scene, the elastic one first."""
    return [decision.effect for decision in decide(scene, moved) if decision.acts]


def modules(scene: Scene, moved: Moved) -> list[str]:
    """Return the modules of the effects and of the integrator that a scene imports by name."""
    effects = [EFFECTS[name].module for name in acting(scene, moved) if name in EFFECTS]
    return [*dict.fromkeys(effects), INTEGRATORS[scene.integrator]]


def has_forces(scene: Scene) -> bool:
    """Return whether forces are told of a scene: contact, hooks or threads act."""
    return bool(scene.contact or scene.hooks or scene.threads)


def has_driven(scene: Scene) -> bool:
    """Return whether an instrument that can be met moves before a scene's end, or hooks or threads act in it."""
    for tool in scene.contact.instruments if scene.contact else []:
        places = zip(tool.times_s or [], tool.shifts_m or [], strict=True)
        if any(a < scene.duration_s and b > 0.0 and here != there for (a, here), (b, there) in pairwise(places)):
            return True
    return bool(scene.hooks or scene.threads)


def decide(scene: Scene, moved: Moved) -> list[Decision]:
    """Return the decision on every effect there is, the elastic ones first."""
    elastic, why = _elastic(scene, moved)
    decisions = [Decision(elastic, True, why)]
    decisions += [Decision(name, False, f"{elastic} holds the body together") for name in ELASTIC if name != elastic]
    for name, effect in EFFECTS.items():
        if effect.role != "elastic":
            decisions.append(Decision(name, *_other(name, scene, moved)))
    return decisions + [Decision(name, True, "a file of the scene's own") for name in scene.own]


def _elastic(scene: Scene, moved: Moved) -> tuple[str, str]:
    for name in ("shape_matching", "springs"):
        if getattr(scene, name) is not None:
            return name, "the scene describes it"
    return {
        "sheet": ("triangles", "the body is a sheet"),
        "solid": (of_law(moved.law), "the body is made of tetrahedra"),
        "surface": ("springs", "the particles are a surface without an inside"),
    }[moved.form]


def _other(name: str, scene: Scene, moved: Moved) -> tuple[bool, str]:
    """Return whether an effect that is not elastic acts, and the reason."""
    if name not in ("held", "bed"):
        acts = getattr(scene, name) is not None
        return acts, "the scene describes it" if acts else "the scene does not describe it"
    if not scene.held:
        return False, "the scene lets the body go"
    if name == "bed":
        return moved.bedded, "the body lies on an elastic bed" if moved.bedded else "no body has a bed"
    return moved.anchored > 0, f"{moved.anchored} nodes are anchored" if moved.anchored else "no node is anchored"
