"""Rayleigh damping: proportional to mass and to stiffness."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Force, Proportional, Stiffness, offers
from palpate.linalg.block_pattern import BlockPattern, product, scatter, shared_pattern


def make(particles: Particles, rayleigh: settings.Rayleigh, elastic: Effect | None) -> "Rayleigh":
    """Make C of the rates in ``rayleigh``; its part of the stiffness is 0 if the elastic effect has none."""
    stiff = elastic if offers(elastic, Stiffness) else None
    return Rayleigh(particles.masses, rayleigh.mass_1_s, rayleigh.stiffness_s, stiff)


class Rayleigh(Force, Proportional):
    """Damping by C(x) = mass_1_s M + stiffness_s K(x), with the elastic Hessian K clamped to positive semidefinite.

    ``couples`` are those of the elastic effect, and each node's mass is divided equally among its elements. The mass
    term also damps translation and rotation of the whole body; the stiffness term does not, except rotation under
    stress. Trap: for an explicit integrator ``add_force`` assembles the matrix in each step, which is exact but slow,
    and the damping shortens its stable step.
    """

    def __init__(self, masses: np.ndarray, mass_rate: float, stiffness_time: float, elastic: Stiffness | None):
        self.damping_rates = mass_rate, stiffness_time
        self._time, self._elastic = stiffness_time, elastic if stiffness_time > 0.0 else None
        self.couples = np.arange(len(masses))[:, None] if self._elastic is None else self._elastic.couples
        count = np.bincount(self.couples.ravel(), minlength=len(masses))
        shares = (mass_rate * masses / np.maximum(count, 1))[self.couples]
        self._masses, self._size = np.multiply.outer(shares.ravel(), np.eye(3)), len(masses)

    @cached_property
    def _pattern(self) -> BlockPattern:
        """The pattern of the damping matrix alone, which implicit steps do not need."""
        return shared_pattern([self.couples], self._size)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        values = np.zeros((len(self._pattern.indices), 3, 3))
        self.add_damping(x, self._pattern.slots[0], values)
        force -= product(self._pattern.matrix(values))(v)

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        if self._elastic is not None:
            stiffness = np.zeros_like(values)
            self._elastic.add_stiffness(x, True, slots, stiffness)
            values += self._time * stiffness
        scatter(np.diagonal(slots, axis1=1, axis2=2).ravel(), self._masses, values)


def damping_of(
    rates: settings.Rayleigh, masses: Any, clamped: Callable[[], Callable[[np.ndarray], np.ndarray]]
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the product of C = α M + β K with velocities (n, k).

    rates : α and β; masses : M (n, n); clamped : makes the product with K, and is not called if β is 0
    """
    stiffness = clamped() if rates.stiffness_s else None

    def multiply(v: np.ndarray) -> np.ndarray:
        force = rates.mass_1_s * (masses @ v)
        return force if stiffness is None else force + rates.stiffness_s * stiffness(v)

    return multiply


def stage_factors(mass_1_s: float, stiffness_s: float, tau: float) -> tuple[float, float]:
    """Return the factors of M and K, 1/τ² + α/τ [1/s²] and 1 + β/τ, in the Hessian of an implicit stage of τ [s]."""
    return 1.0 / tau**2 + mass_1_s / tau, 1.0 + stiffness_s / tau
