"""``effects: auto``: the effects that a scene calls for, each with the reason."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError
from palpate.scenes.effect_registry import DAMPINGS, EFFECTS, ELASTIC, of_law
from palpate.scenes.scene import Scene

OWN_POISSON = 0.25
"""Poisson's ratio of a spring network (Kot and Nagahashi): to reach a higher one, it needs the effect volume."""

Answer = tuple[bool, str]
"""Whether an effect is called, and the reason."""


@dataclass(frozen=True)
class Decision:
    """An effect, whether a scene calls for it, and the reason."""

    effect: str
    called: bool
    reason: str


def decide(scene: Scene, particles: Particles) -> list[Decision]:
    """Return a decision on every effect there is, the elastic ones first.

    Raises InputError if the scene describes two elastic effects.
    """
    elastic, why = _elastic(scene, particles)
    decisions = [Decision(elastic, True, why)]
    decisions += [Decision(name, False, f"{elastic} holds the body together") for name in ELASTIC if name != elastic]
    for name, entry in EFFECTS.items():
        if entry.role == "other":
            answer = RULES[name](scene, particles, elastic) if name in RULES else _described(scene, name)
            decisions.append(Decision(name, *answer))
    moves = [d.effect for d in decisions if d.called and d.effect in ("gravity", "push", "contact")]
    moves += scene.own
    if scene.start != "rest":
        moves.append(f"the start, {scene.start}")
    decisions += _dampings(scene, elastic, moves)
    decisions += [Decision(name, True, "a file of the scene's own") for name in scene.own]
    return decisions


def _elastic(scene: Scene, particles: Particles) -> tuple[str, str]:
    described = [name for name in ("springs", "shape_matching") if name in scene.settings]
    if len(described) > 1:
        raise InputError(
            f"{scene.place} describes both springs and shape_matching; keep one of them, or name the effects."
        )
    if described:
        return described[0], "the scene describes it"
    if particles.thickness_m:
        return "triangles", "the body is a sheet"
    if len(particles.tetrahedra):
        return of_law(particles.material.law), "the body is made of tetrahedra"
    return "springs", "the particles are a surface without an inside"


def _described(scene: Scene, name: str) -> Answer:
    """Decide on an effect without a rule of its own."""
    if name in scene.settings:
        return True, "the scene describes it"
    return False, "the scene does not describe it"


def _gravity(scene: Scene, particles: Particles, elastic: str) -> Answer:
    acceleration = scene.settings.get("gravity", {}).get("acceleration_m_s2", [0, 0, 0])
    if not np.any(acceleration):
        return False, "no acceleration is given"
    if not particles.masses.any():
        return False, "the body has no mass"
    return True, f"{np.linalg.norm(acceleration):.3g} m/s² act on {particles.masses.sum():.3g} kg"


def _held(scene: Scene, particles: Particles, elastic: str) -> Answer:
    if not scene.held:
        return False, "the scene lets the body go"
    if not len(particles.held):
        return False, "no node of these particles is anchored"
    return True, f"{len(particles.held)} nodes are anchored"


def _bed(scene: Scene, particles: Particles, elastic: str) -> Answer:
    if not scene.held:
        return False, "the scene lets the body go"
    if not particles.beds:
        return False, "no body has a bed"
    return True, "the body lies on an elastic bed"


def _push(scene: Scene, particles: Particles, elastic: str) -> Answer:
    loads = [load for load in scene.settings.get("push", {}).get("loads", []) if np.any(load["force_n"])]
    return bool(loads), f"loads that push: {len(loads)}" if loads else "nothing pushes"


def _bending(scene: Scene, particles: Particles, elastic: str) -> Answer:
    if elastic == "triangles":
        return True, f"the sheet is {1e3 * particles.thickness_m:g} mm thick"
    return False, "only triangles lack a resistance to bending"


def _volume(scene: Scene, particles: Particles, elastic: str) -> Answer:
    poisson = particles.material.poisson
    if elastic != "springs" or not len(particles.tetrahedra):
        return False, f"{elastic} keeps what volume it should, or there is none to keep"
    if poisson <= OWN_POISSON and "volume" not in scene.settings:
        return False, f"a spring network has Poisson's ratio 1/4 by itself, {poisson:g} is asked"
    return True, f"springs alone would lose volume: Poisson's ratio {poisson:g} is asked, 1/4 given"


def _body_springs(scene: Scene, particles: Particles, elastic: str) -> Answer:
    if elastic == "springs" and not len(particles.tetrahedra) and not particles.thickness_m:
        return True, "a closed surface of springs has no inside that resists"
    return False, "the body resists by itself"


def _contact(scene: Scene, particles: Particles, elastic: str) -> Answer:
    settings = scene.settings.get("contact", {})
    if instruments := settings.get("instruments", []):
        return True, f"instruments that the body can meet: {len(instruments)}"
    if scene.others:
        return True, f"bodies that can meet each other: {1 + len(scene.others)}"
    if settings.get("self_contact"):
        return True, "the scene says that the body can meet itself"
    return False, "there is one body and nothing that it can meet"


def _plasticity(scene: Scene, particles: Particles, elastic: str) -> Answer:
    if scene.settings.get("plasticity", {}).get("max_strain", 0) > 0:
        return True, f"the body yields above {scene.settings['plasticity']['yield_strain']:g}"
    return False, "the body does not yield"


def _dampings(scene: Scene, elastic: str, moves: list[str]) -> list[Decision]:
    asked = [name for name in DAMPINGS if name in scene.settings]
    suits = asked or [EFFECTS[elastic].damping]
    found = []
    for name in DAMPINGS:
        if not moves:
            found.append(Decision(name, False, "nothing moves the body"))
        elif name not in suits:
            found.append(Decision(name, False, f"{suits[0]} damps it"))
        else:
            why = "the scene describes it" if asked else f"suits {elastic}"
            found.append(Decision(name, True, f"the body moves ({', '.join(moves)}); {why}"))
    return found


RULES: dict[str, Callable[[Scene, Particles, str], Answer]] = {
    "gravity": _gravity,
    "held": _held,
    "bed": _bed,
    "push": _push,
    "bending": _bending,
    "volume": _volume,
    "body_springs": _body_springs,
    "contact": _contact,
    "plasticity": _plasticity,
}
"""Rules for effects that a scene may call for, or not, without a block of their name."""
