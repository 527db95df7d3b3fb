"""Nodes that do not move: the body's anchors."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, FixedNodes


def make(particles: Particles, settings: object, elastic: Effect | None) -> "Held":
    """Hold the anchors of ``particles``."""
    return Held(particles.held)


class Held(FixedNodes):
    """The nodes ``fixed`` (k,), which no force moves; integrators leave them out of their unknowns."""

    def __init__(self, fixed: np.ndarray):
        self.fixed = fixed
