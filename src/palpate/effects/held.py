"""Nodes that stay where they are: the body's anchors."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic) -> "Held":
    """Hold the anchors of ``particles``; InputError if there are none."""
    if not len(particles.held):
        raise InputError(
            f"{particles.name}: effect held has no node to hold; give the body anchors, or leave held out of the scene."
        )
    return Held(particles.held)


class Held:
    """``fixed`` (k,): the nodes that no force moves. The integrator leaves them out; there is nothing to compute."""

    def __init__(self, fixed: np.ndarray):
        self.fixed = fixed
