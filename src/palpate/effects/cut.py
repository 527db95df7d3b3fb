"""A cut that is made while a body moves: a blade passes, and the nodes on its two sides are let go."""

import numpy as np

from palpate.bodies.cutting.ties import Ties
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Observation, Untying
from palpate.errors import InputError


def make(particles: Particles, settings: object, elastic: Effect | None) -> "CutInTime":
    """Make the cut that ``particles`` were prepared for with the same ``settings``; InputError if they were not."""
    if particles.ties is None:
        raise InputError(f"{particles.name} was not prepared for a cut; make the particles by particles_in.")
    return CutInTime(particles.ties)


class CutInTime(Untying, Observation):
    """The ties of the nodes along the cut, each of which ends when the blade has passed it in the body at rest.

    No force and no energy: surfaces are made at no cost, and what tissue resists a blade with is not counted.
    """

    def __init__(self, ties: Ties):
        self._ties = ties
        self.changes_s = np.unique(ties.let_go_s)

    def leaders(self, t: float) -> np.ndarray:
        return self._ties.leaders(t)

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Record how far the lips are apart at most: ``cut_opening_m`` of two nodes that were one."""
        lip, opposite = self._ties.pairs.T
        return {"cut_opening_m": float(np.linalg.norm(x[lip] - x[opposite], axis=1).max())}
