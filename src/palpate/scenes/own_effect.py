"""Effects from the user's own files, each of which is checked before a scene runs.

The force is compared with the energy, and the stiffness with the force, by central differences.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Effect, Energy, Stiffness, offers
from palpate.errors import InputError
from palpate.linalg.block_pattern import shared_pattern
from palpate.own_file import EFFECT_FUNCTIONS, failure, import_file
from palpate.scenes.settings import Scene

MOVED, STEP = 1e-2, 1e-6
"""Displacement of each node, and the step of the differences, relative to the shortest edge of the surface."""
DIRECTIONS = 3
FORCE_ERROR, STIFFNESS_ERROR = 1e-3, 5e-2
"""Relative errors that are accepted: of the force, and of the stiffness, which may be an approximation."""


def disagreement(effect: Effect, particles: Particles) -> str:
    """Return a sentence on how far force and energy, or stiffness and force, disagree near rest; empty if they agree.

    The nodes are displaced at random, always alike. Values that are not finite are not compared.
    """
    if not offers(effect, hooks.Energy):
        return ""
    generator = np.random.default_rng(1)
    corners = particles.nodes[particles.triangles]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min())
    x = particles.nodes + MOVED * edge * generator.uniform(-1.0, 1.0, particles.nodes.shape)
    steps = [STEP * edge * generator.standard_normal(x.shape) for _ in range(DIRECTIONS)]
    reason = "differs by {:.2g} of its size from minus the gradient of {}, by central differences at a displaced state"
    if (error := _force_error(effect, x, steps)) > FORCE_ERROR:
        return "add_force " + reason.format(error, "energy")
    if offers(effect, hooks.Stiffness) and (error := _stiffness_error(effect, x, steps)) > STIFFNESS_ERROR:
        return "add_stiffness " + reason.format(error, "add_force")
    return ""


def _force_error(effect: Energy, x: np.ndarray, steps: list[np.ndarray]) -> float:
    """Return the relative error of the force in changes of the energy along ``steps`` and along the force itself."""
    force = _force(effect, x)
    norm = float(np.linalg.norm(force))
    along = [*steps, force * (np.linalg.norm(steps[0]) / norm)] if norm > 0.0 else steps
    energies = np.array([[effect.energy(x + step), effect.energy(x - step)] for step in along])
    changes, works = energies[:, 0] - energies[:, 1], np.array([-2.0 * np.vdot(force, step) for step in along])
    rounding = 8.0 * np.finfo(float).eps * np.abs(energies).max()
    return _relative(changes, works, rounding)


def _stiffness_error(effect: Stiffness, x: np.ndarray, steps: list[np.ndarray]) -> float:
    """Return the relative error of the stiffness in changes of the force along ``steps``."""
    pattern = shared_pattern([np.asarray(effect.couples)], len(x))
    values = np.zeros((len(pattern.indices), 3, 3))
    effect.add_stiffness(x, False, pattern.slots[0], values)
    matrix = pattern.matrix(values)
    products = np.array([-2.0 * (matrix @ step.ravel()) for step in steps])
    changes = np.array([(_force(effect, x + step) - _force(effect, x - step)).ravel() for step in steps])
    rounding = 8.0 * np.finfo(float).eps * float(np.linalg.norm(_force(effect, x)))
    return _relative(changes, products, rounding)


def _force(effect: Effect, x: np.ndarray) -> np.ndarray:
    force = np.zeros_like(x)
    effect.add_force(x, np.zeros_like(x), force)  # type: ignore[attr-defined]
    return force


def _relative(actual: np.ndarray, expected: np.ndarray, rounding: float) -> float:
    """Return the difference of two arrays over the larger one; 0 if it is within ``rounding``, or not finite."""
    off, size = float(np.linalg.norm(actual - expected)), float(max(np.linalg.norm(actual), np.linalg.norm(expected)))
    if not np.isfinite(off + size) or off <= rounding * np.sqrt(actual.size):
        return 0.0
    return off / size


ACTING = (
    hooks.Force, hooks.Stiffness, hooks.Damping, hooks.FixedNodes, hooks.Projection, hooks.StepBegin,
    hooks.StepLimit, hooks.Touching, hooks.Relaxation, hooks.Goals, hooks.Observation, hooks.Contacts,
)  # fmt: skip
"""An effect that offers none of these hooks does nothing."""
GUIDE = "see docs/add-an-effect.md"


class Maker(Protocol):
    """An effect of the user's, as an object with its settings, that can be made for particles."""

    def make(self, particles: Particles, elastic: Effect | None) -> Effect:
        """Return the effect on ``particles``, which offers hooks of ``effects.effect``."""


def make(name: str, scene: Scene, particles: Particles, elastic: Effect | None) -> Effect:
    """Return one of the scene's own effects, which was tried at rest and near it; InputError names file and fault."""
    path = Path(scene.own[name])
    module = import_file(path, f"{scene.place}.own.{name}")
    if not hasattr(module, "make"):
        raise InputError(f"{path}: has no function {EFFECT_FUNCTIONS[0]}; {GUIDE}.")
    return checked(str(path), lambda: module.make(particles, scene.own_settings.get(name, {}), elastic), particles)


def checked(place: str, made: Callable[[], Effect], particles: Particles) -> Effect:
    """Return the effect that ``made`` makes, tried at rest and near it; InputError names ``place`` and the fault."""
    try:
        effect = made()
        fault = _fault(effect, particles) or disagreement(effect, particles)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{place}: does not work ({failure(error)}); correct it, {GUIDE}.") from error
    if fault:
        raise InputError(f"{place}: {fault}; correct it, {GUIDE}.")
    return effect


def _fault(effect: Effect, particles: Particles) -> str:
    """Return a sentence on the first fault of an effect; empty if there is none."""
    if lack := hooks.incomplete(effect):
        return f"the effect has {lack}"
    if not any(offers(effect, hook) for hook in ACTING):
        return f"what make returns has none of {', '.join(hooks.members(hook)[0] for hook in ACTING)}"
    n = len(particles.nodes)
    node_arrays = {"couples": effect.couples} if offers(effect, hooks.Couples) else {}
    node_arrays |= {"fixed": effect.fixed} if offers(effect, hooks.FixedNodes) else {}
    for name, array in node_arrays.items():
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
