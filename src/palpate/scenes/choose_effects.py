"""``effects: auto``: the effects that a scene calls for, each with the reason."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError
from palpate.scenes.effect_registry import ELASTIC
from palpate.scenes.scene import Scene

OWN_POISSON = 0.25
"""Poisson's ratio that a spring network has by itself (Kot and Nagahashi): above it, it loses volume."""
DAMPING = {
    "corotational": "rayleigh",
    "triangles": "rayleigh",
    "springs": "kelvin",
    "shape_matching": "velocity_damping",
}
"""Which damping suits an elastic effect if the scene asks for none in particular."""
DAMPINGS = ("rayleigh", "kelvin", "maxwell", "velocity_damping")


@dataclass(frozen=True)
class Decision:
    """Whether a scene calls for an effect, and why."""

    effect: str
    called: bool
    reason: str


def decide(scene: Scene, particles: Particles) -> list[Decision]:
    """A decision on every effect there is, the elastic ones first; InputError if two elastic effects are described."""
    elastic, why = _elastic(scene, particles)
    decisions = [Decision(elastic, True, why)]
    decisions += [Decision(name, False, f"{elastic} holds the body together") for name in ELASTIC if name != elastic]
    decisions += [
        _gravity(scene, particles),
        _held(scene, particles),
        _push(scene),
        _bending(particles, elastic),
        _volume(scene, particles, elastic),
        _body_springs(particles, elastic),
        _contact(scene),
        _plasticity(scene),
    ]
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
        return "corotational", "the body is made of tetrahedra"
    return "springs", "the particles are a surface without an inside"


def _gravity(scene, particles) -> Decision:
    acceleration = scene.settings.get("gravity", {}).get("acceleration_m_s2", [0, 0, 0])
    if not np.any(acceleration):
        return Decision("gravity", False, "no acceleration is given")
    if not particles.masses.any():
        return Decision("gravity", False, "the body has no mass")
    return Decision("gravity", True, f"{np.linalg.norm(acceleration):.3g} m/s² act on {particles.masses.sum():.3g} kg")


def _held(scene, particles) -> Decision:
    if not scene.held:
        return Decision("held", False, "the scene lets the body go")
    if not len(particles.held):
        return Decision("held", False, "no node of these particles is anchored")
    return Decision("held", True, f"{len(particles.held)} nodes are anchored")


def _push(scene) -> Decision:
    loads = [load for load in scene.settings.get("push", {}).get("loads", []) if np.any(load["force_n"])]
    return Decision("push", bool(loads), f"loads that push: {len(loads)}" if loads else "nothing pushes")


def _bending(particles, elastic) -> Decision:
    if elastic == "triangles":
        return Decision("bending", True, f"the sheet is {1e3 * particles.thickness_m:g} mm thick")
    return Decision("bending", False, "only triangles lack a resistance to bending")


def _volume(scene, particles, elastic) -> Decision:
    poisson = particles.material.poisson
    if elastic != "springs" or not len(particles.tetrahedra):
        return Decision("volume", False, f"{elastic} keeps what volume it should, or there is none to keep")
    if poisson <= OWN_POISSON and "volume" not in scene.settings:
        return Decision("volume", False, f"a spring network has Poisson's ratio 1/4 by itself, {poisson:g} is asked")
    return Decision("volume", True, f"springs alone would lose volume: Poisson's ratio {poisson:g} is asked, 1/4 given")


def _body_springs(particles, elastic) -> Decision:
    if elastic == "springs" and not len(particles.tetrahedra) and not particles.thickness_m:
        return Decision("body_springs", True, "a closed surface of springs has no inside that resists")
    return Decision("body_springs", False, "the body resists by itself")


def _contact(scene) -> Decision:
    settings = scene.settings.get("contact", {})
    if instruments := settings.get("instruments", []):
        return Decision("contact", True, f"instruments that the body can meet: {len(instruments)}")
    if scene.others:
        return Decision("contact", True, f"bodies that can meet each other: {1 + len(scene.others)}")
    if settings.get("self_contact"):
        return Decision("contact", True, "the scene says that the body can meet itself")
    return Decision("contact", False, "there is one body and nothing that it can meet")


def _plasticity(scene) -> Decision:
    if scene.settings.get("plasticity", {}).get("max_strain", 0) > 0:
        return Decision("plasticity", True, f"the body yields above {scene.settings['plasticity']['yield_strain']:g}")
    return Decision("plasticity", False, "the body does not yield")


def _dampings(scene, elastic, moves) -> list[Decision]:
    asked = [name for name in DAMPINGS if name in scene.settings]
    suits = asked or [DAMPING[elastic]]
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
