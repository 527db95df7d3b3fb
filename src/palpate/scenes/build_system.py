"""Compose the system of a scene: exactly the effects that it names."""

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect
from palpate.errors import InputError
from palpate.scenes import effect_registry, own_effect
from palpate.scenes.acting_effects import Moved, acting, decide
from palpate.scenes.scene import Scene
from palpate.solvers.system import System


def moved(particles: Particles) -> Moved:
    """Return what decides on effects of ``particles``."""
    form = "sheet" if particles.thickness_m else "solid" if len(particles.tetrahedra) else "surface"
    held, mass_kg, material = len(particles.held), float(particles.masses.sum()), particles.material
    return Moved(form, material.law, bool(particles.beds), held, mass_kg, material.poisson, particles.thickness_m)


def effect_names(scene: Scene, particles: Particles) -> list[str]:
    """Return the effects that the scene calls for, the elastic one first."""
    names = acting(scene.entry, moved(particles), scene.place)
    return sorted(names, key=lambda name: name not in effect_registry.ELASTIC)


def decisions(scene: Scene, particles: Particles) -> pd.DataFrame:
    """Tabulate one row for each effect there is: scene, effect, called, auto, reason.

    auto : whether ``effects: auto`` would call it
    """
    chosen = effect_names(scene, particles)
    found = decide(scene.entry, moved(particles), scene.place)
    rows = [[scene.name, d.effect, d.effect in chosen, d.called, d.reason] for d in found]
    return pd.DataFrame(rows, columns=["scene", "effect", "called", "auto", "reason"])


def compose(scene: Scene, particles: Particles, without: str | None = None) -> System:
    """Import and make the effects of a scene, and no others; ``without`` names one to leave out.

    Raises InputError for one that does not suit the particles, and for nodes without mass.
    """
    effects: dict[str, Effect] = {}
    for name in effect_names(scene, particles):
        if name == without:
            continue
        elastic = next(iter(effects.values()), None)
        if name in scene.own:
            effects[name] = own_effect.make(name, scene, particles, elastic)
        else:
            settings = scene.settings.get(name, effect_registry.EFFECTS[name].settings or {})
            effects[name] = effect_registry.effect(name).make(particles, dict(settings), elastic)
    system = System(particles, effects)
    if (particles.masses[system.free] <= 0.0).any():
        node = int(np.flatnonzero(system.free & (particles.masses <= 0.0))[0])
        raise InputError(f"{scene.place}: node {node} of {particles.name} has no mass; remove nodes without elements.")
    return system
