"""Damping proportional to velocity, as in a viscous fluid."""

import math

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Force, Projection, Proportional


def make(particles: Particles, damping: settings.VelocityDamping, elastic: Effect | None) -> "VelocityDamping":
    """Damp every node at ``damping.rate_1_s`` [1/s]."""
    return VelocityDamping(particles.masses, damping.rate_1_s)


class VelocityDamping(Force, Proportional, Projection):
    """Damping by C = rate · M: without other forces all velocities, also the mean one, decay as exp(−rate t).

    An explicit integrator uses ``project``, the exact decay, stable for any step; the force would require h · rate < 2.
    """

    def __init__(self, masses: np.ndarray, rate: float):
        self.couples = np.arange(len(masses))[:, None]
        self.damping_rates = rate, 0.0
        self._rate, self._coefficients = rate, rate * masses

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force -= self._coefficients[:, None] * v

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        places = slots[:, 0, 0]  # one for each node, so none is repeated
        for i in range(3):
            values[places, i, i] += self._coefficients

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        v *= math.exp(-self._rate * h)
