"""Gravity: the weight of each node."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Energy, Weight


def make(particles: Particles, gravity: settings.Gravity, elastic: Effect | None) -> "Gravity":
    """Make the weight of ``particles`` under ``gravity.acceleration_m_s2``, (3,) [m/s²]."""
    return Gravity(particles, np.array(gravity.acceleration_m_s2, dtype=float))


class Gravity(Energy, Weight):
    """Weight with E = −Σ m g · (x − x⁰), zero at the rest positions."""

    def __init__(self, particles: Particles, acceleration: np.ndarray):
        self.acceleration, self._rest = acceleration, particles.nodes
        self._weight = np.outer(particles.masses, acceleration)

    def energy(self, x: np.ndarray) -> float:
        return -float(np.vdot(self._weight, x - self._rest))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._weight
