"""Damping proportional to velocity, as in a viscous fluid."""

import math

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Projection
from palpate.effects.rayleigh import Rayleigh


def make(particles: Particles, damping: settings.VelocityDamping, elastic: Effect | None) -> "VelocityDamping":
    """Damp every node at ``damping.rate_1_s`` [1/s]."""
    return VelocityDamping(particles.masses, damping.rate_1_s)


class VelocityDamping(Rayleigh, Projection):
    """C = rate · M: without other forces all velocities decay as exp(−rate t), that of the whole body included.

    An explicit integrator uses ``project``, the exact decay, which is stable for any step; the force would require
    h · rate < 2.
    """

    def __init__(self, masses: np.ndarray, rate: float):
        super().__init__(masses, rate, 0.0, None)
        self._rate = rate

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        v *= math.exp(-self._rate * h)
