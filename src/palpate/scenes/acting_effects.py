"""Which effects act in a scene: the elastic one, anchors and bed of its bodies, and those that its blocks describe.

The check of settings, the digest of code and the run all ask here. Before a body is made, its nodes are assumed to be
anchored.
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
class BodyTraits:
    """The properties of a scene's bodies that decide which effects act.

    form : one of FORMS; law : of the material; bedded : whether a body has a bed; anchored : number of anchored nodes
    """

    form: str
    law: str = LAWS[0]
    bedded: bool = False
    anchored: float = np.inf


def assumed(scene: Scene, body: Body) -> BodyTraits:
    """Return the traits that follow from the settings of a scene and of its body, before the body is made."""
    form = "sheet" if body.kind == "sheet" else "surface" if scene.surface else "solid"
    return BodyTraits(form, getattr(body, "law", None) or LAWS[0], getattr(body, "bed", None) is not None)


def acting(scene: Scene, traits: BodyTraits) -> list[str]:
    """Return the names of the effects that act in a scene, the elastic one first."""
    return [decision.effect for decision in decide(scene, traits) if decision.acts]


def modules(scene: Scene, traits: BodyTraits) -> list[str]:
    """Return the modules of the effects and of the integrator that a scene imports by name."""
    effects = [EFFECTS[name].module for name in acting(scene, traits) if name in EFFECTS]
    return [*dict.fromkeys(effects), INTEGRATORS[scene.integrator]]


def has_forces(scene: Scene) -> bool:
    """Return whether a scene records forces: of contact, hooks or threads."""
    return bool(scene.contact or scene.hooks or scene.threads)


def has_driven(scene: Scene) -> bool:
    """Return whether something is moved from outside: an instrument before the scene's end, a hook or a thread."""
    for tool in scene.contact.instruments if scene.contact else []:
        places = zip(tool.times_s or [], tool.shifts_m or [], strict=True)
        if any(a < scene.duration_s and b > 0.0 and here != there for (a, here), (b, there) in pairwise(places)):
            return True
    return bool(scene.hooks or scene.threads)


def decide(scene: Scene, traits: BodyTraits) -> list[Decision]:
    """Return for each effect of palpate and of the scene's own whether it acts, the elastic ones first."""
    elastic, why = _elastic(scene, traits)
    decisions = [Decision(elastic, True, why)]
    decisions += [Decision(name, False, f"{elastic} holds the body together") for name in ELASTIC if name != elastic]
    for name, effect in EFFECTS.items():
        if effect.role != "elastic":
            decisions.append(Decision(name, *_other(name, scene, traits)))
    return decisions + [Decision(name, True, "a file of the scene's own") for name in scene.own]


def _elastic(scene: Scene, traits: BodyTraits) -> tuple[str, str]:
    for name in ("shape_matching", "springs"):
        if getattr(scene, name) is not None:
            return name, "the scene describes it"
    return {
        "sheet": ("triangles", "the body is a sheet"),
        "solid": (of_law(traits.law), "the body is made of tetrahedra"),
        "surface": ("springs", "the particles are a surface without an inside"),
    }[traits.form]


def _other(name: str, scene: Scene, traits: BodyTraits) -> tuple[bool, str]:
    """Return whether the effect ``name``, not an elastic one, acts in ``scene``, and the reason in words."""
    if name not in ("held", "bed"):
        acts = getattr(scene, name) is not None
        return acts, "the scene describes it" if acts else "the scene does not describe it"
    if not scene.held:
        return False, "the scene lets the body go"
    if name == "bed":
        return traits.bedded, "the body lies on an elastic bed" if traits.bedded else "no body has a bed"
    return traits.anchored > 0, f"{traits.anchored} nodes are anchored" if traits.anchored else "no node is anchored"
