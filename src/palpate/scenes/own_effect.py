"""Load effects from the user's own files, and check each before a scene runs."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Effect, offers
from palpate.errors import InputError
from palpate.own_file import EFFECT_FUNCTIONS, failure, import_file

ACTING = (
    hooks.Force,
    hooks.Stiffness,
    hooks.Damping,
    hooks.FixedNodes,
    hooks.Projection,
    hooks.StepBegin,
    hooks.StepLimit,
    hooks.Touching,
    hooks.Relaxation,
    hooks.Goals,
    hooks.Observation,
    hooks.Contacts,
)
"""An effect that offers none of these hooks does nothing."""
GUIDE = "see docs/add-an-effect.md"


def load(name: str, path: Path, place: str) -> ModuleType:
    """Import the module in the file ``path``; InputError unless it has a function ``make``."""
    module = import_file(path, f"{place}.own.{name}")
    if not hasattr(module, "make"):
        raise InputError(f"{path}: has no function {EFFECT_FUNCTIONS[0]}; {GUIDE}.")
    return module


def make(
    path: Path, module: ModuleType, particles: Particles, settings: dict[str, Any], elastic: Effect | None
) -> Effect:
    """Make the effect of ``module`` and call it at rest and near it; InputError naming the file and the fault."""
    from palpate.scenes.own_derivatives import disagreement

    try:
        effect = module.make(particles, settings, elastic)
        fault = _fault(effect, particles) or disagreement(effect, particles)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path}: does not work ({failure(error)}); correct it, {GUIDE}.") from error
    if fault:
        raise InputError(f"{path}: {fault}; correct it, {GUIDE}.")
    return effect


def _fault(effect: Effect, particles: Particles) -> str:
    """Describe the first fault of an effect; empty if there is none."""
    if lack := hooks.incomplete(effect):
        return f"the effect has {lack}"
    if not any(offers(effect, hook) for hook in ACTING):
        return f"what make returns has none of {', '.join(hooks.members(hook)[0] for hook in ACTING)}"
    n = len(particles.nodes)
    numbers = {"couples": effect.couples} if offers(effect, hooks.Couples) else {}
    numbers |= {"fixed": effect.fixed} if offers(effect, hooks.FixedNodes) else {}
    for name, array in numbers.items():
        nodes = np.asarray(array)
        if nodes.size and (nodes.dtype.kind != "i" or nodes.min() < 0 or nodes.max() >= n):
            return f"{name} names nodes other than 0 to {n - 1}"
    if offers(effect, hooks.Time):
        effect.at(0.0)
    if offers(effect, hooks.Force):
        x, force = particles.nodes.copy(), np.zeros((n, 3))
        add: Any = effect.add_force  # it is not known yet to return None
        if add(x, np.zeros((n, 3)), force) is not None:
            return "add_force returns a value, but must add to its third argument in place"
        if not np.array_equal(x, particles.nodes):
            return "add_force changes the positions it is given"
        if not np.isfinite(force).all():
            return "add_force gives forces at rest that are not finite"
    if offers(effect, hooks.Energy) and not np.isfinite(effect.energy(particles.nodes.copy())):
        return "energy at rest is not a finite number"
    return ""
