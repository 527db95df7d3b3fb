"""Compare the force of a user's effect with its energy, and its stiffness with its force, by central differences."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Effect, Energy, Stiffness, offers
from palpate.linalg.block_pattern import shared_pattern

MOVED, STEP = 1e-2, 1e-6
"""Displacement of each node, and the step of the differences, relative to the shortest edge of the surface."""
DIRECTIONS = 3
FORCE_ERROR, STIFFNESS_ERROR = 1e-3, 5e-2
"""Relative errors that are accepted: of the force, and of the stiffness, which may be an approximation."""
DISPLACED = "by central differences at a displaced state"


def disagreement(effect: Effect, particles: Particles) -> str:
    """Describe by how much force and energy, or stiffness and force, disagree near rest; empty if they agree.

    Nothing is compared where a value is not finite. The nodes are moved at random, in the same way each time.
    """
    if not offers(effect, hooks.Energy):
        return ""
    random = np.random.default_rng(1)
    corners = particles.nodes[particles.triangles]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min())
    x = particles.nodes + MOVED * edge * random.uniform(-1.0, 1.0, particles.nodes.shape)
    steps = [STEP * edge * random.standard_normal(x.shape) for _ in range(DIRECTIONS)]
    error = _force_error(effect, x, steps)
    if error > FORCE_ERROR:
        return f"add_force differs by {error:.2g} of its size from minus the gradient of energy, {DISPLACED}"
    if offers(effect, hooks.Stiffness):
        error = _stiffness_error(effect, x, steps)
        if error > STIFFNESS_ERROR:
            return f"add_stiffness differs by {error:.2g} of its size from minus the gradient of add_force, {DISPLACED}"
    return ""


def _force_error(effect: Energy, x: np.ndarray, steps: list[np.ndarray]) -> float:
    """Compare changes of the energy with the work of the force along ``steps``, and along the force itself."""
    force = _force(effect, x)
    norm = float(np.linalg.norm(force))
    along = [*steps, force * (np.linalg.norm(steps[0]) / norm)] if norm > 0.0 else steps
    energies = np.array([[effect.energy(x + step), effect.energy(x - step)] for step in along])
    changes, works = energies[:, 0] - energies[:, 1], np.array([-2.0 * np.vdot(force, step) for step in along])
    rounding = 8.0 * np.finfo(float).eps * np.abs(energies).max()
    return _relative(changes, works, rounding)


def _stiffness_error(effect: Stiffness, x: np.ndarray, steps: list[np.ndarray]) -> float:
    """Compare changes of the force along ``steps`` with the product of the stiffness and the step."""
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


def _relative(found: np.ndarray, expected: np.ndarray, rounding: float) -> float:
    """Return how much two arrays differ relative to the larger one; 0 if by no more than rounding, or not finite."""
    off, size = float(np.linalg.norm(found - expected)), float(max(np.linalg.norm(found), np.linalg.norm(expected)))
    if not np.isfinite(off + size) or off <= rounding * np.sqrt(found.size):
        return 0.0
    return off / size
