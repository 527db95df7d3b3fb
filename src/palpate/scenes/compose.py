"""A system of exactly the effects that a scene names."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.errors import InputError
from palpate.scenes import effect_registry, own_effect
from palpate.scenes.choose_effects import decide
from palpate.scenes.scene import Scene
from palpate.solvers.system import System

DEFAULTS: dict[str, Callable[[Particles], dict]] = {
    "corotational": lambda particles: {},
    "triangles": lambda particles: {},
    "bending": lambda particles: {},
    "held": lambda particles: {},
    "springs": lambda particles: {},
    "rayleigh": lambda particles: {"mass_1_s": 1.0, "stiffness_s": 0.01},
    "contact": lambda particles: {"instruments": []},
    "kelvin": lambda particles: {"ratio": 0.1},
    "velocity_damping": lambda particles: {"rate_1_s": 1.0},
    "volume": lambda particles: {"stiffness_n_m": _stiffness(particles)},
    "body_springs": lambda particles: {"stiffness_n_m": _stiffness(particles), "damping_ratio": 0.5},
}
"""Settings of an effect that is named without any; the others say something of the scene that must be given."""


def named(scene: Scene, particles: Particles) -> list[str]:
    """The effects that the scene calls for, the elastic one first.

    Raises InputError unless each is known and exactly one of them is elastic.
    """
    if wrong := effect_registry.unknown([] if scene.effects == "auto" else scene.effects, scene.own):
        raise InputError(f"{scene.place}.{wrong}")
    if scene.effects == "auto":
        return [decision.effect for decision in decide(scene, particles) if decision.called]
    elastic = [name for name in scene.effects if name in effect_registry.ELASTIC]
    if len(elastic) != 1:
        found = " and ".join(elastic) or "none"
        raise InputError(
            f"{scene.place}.effects must name exactly one of {', '.join(effect_registry.ELASTIC)}, but names {found}; "
            "name one, or write effects: auto."
        )
    if not scene.held and "held" in scene.effects:
        raise InputError(f"{scene.place} says held: false, and its effects name held; remove one of them.")
    return elastic + [name for name in scene.effects if name not in elastic]


def decisions(scene: Scene, particles: Particles) -> pd.DataFrame:
    """One row an effect there is: scene, effect, called, auto (whether ``effects: auto`` would call it), reason."""
    chosen = named(scene, particles)
    rows = [[scene.name, d.effect, d.effect in chosen, d.called, d.reason] for d in decide(scene, particles)]
    return pd.DataFrame(rows, columns=["scene", "effect", "called", "auto", "reason"])


def compose(scene: Scene, particles: Particles, without: str | None = None) -> System:
    """Import and make the effects of a scene, and nothing else; ``without`` leaves one of them out.

    Raises InputError for an unknown effect, one that lacks its settings, or one that these particles cannot have.
    """
    effects: dict[str, object] = {}
    for name in named(scene, particles):
        if name == without:
            continue
        elastic, settings = next(iter(effects.values()), None), _settings(scene, particles, name)
        if name in scene.own:
            module = own_effect.load(name, scene.own[name], scene.place)
            effects[name] = own_effect.make(scene.own[name], module, particles, settings, elastic)
        else:
            effects[name] = effect_registry.effect(name).make(particles, settings, elastic)
    system = System(particles, effects)
    if (particles.masses[system.free] <= 0.0).any():
        node = int(np.flatnonzero(system.free & (particles.masses <= 0.0))[0])
        raise InputError(f"{scene.place}: node {node} of {particles.name} has no mass; remove nodes without elements.")
    return system


def _settings(scene: Scene, particles: Particles, name: str) -> dict:
    if name in scene.settings:
        return scene.settings[name]
    if name in DEFAULTS:
        return DEFAULTS[name](particles)
    if name in scene.own:
        return {}
    raise InputError(f"{scene.place}.effects names {name}, and the scene does not describe it; add a block {name}.")


def _stiffness(particles: Particles) -> float:
    """Young's modulus times the mean length of an edge [N/m]: the stiffness of a body's cube of that size."""
    ends = particles.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    lengths = np.linalg.norm(particles.nodes[ends[:, 0]] - particles.nodes[ends[:, 1]], axis=1)
    return particles.material.young_pa * float(lengths.mean())
