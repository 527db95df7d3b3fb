"""Kelvin dampers: one parallel to each spring, against the change of its length."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Damping, Force
from palpate.effects.springs import Springs, add_pair, direction


def make(particles: Particles, kelvin: settings.Kelvin, elastic: Springs) -> "Kelvin":
    """Make dampers of ``ratio`` times critical damping beside springs."""
    return Kelvin(elastic, particles.masses, kelvin.ratio)


def dampings(pairs: np.ndarray, stiffness: np.ndarray, masses: np.ndarray, ratio: float) -> np.ndarray:
    """Compute μ (…, s) [N s/m] of dampers for springs of ``stiffness`` (…, s) [N/m], ``ratio`` times critical."""
    first, second = masses[pairs].T
    return 2.0 * ratio * np.sqrt(stiffness * (first * second / (first + second)))


class Kelvin(Force, Damping):
    """The force −μ (n·Δv) n along each spring, μ = 2 ratio sqrt(k m₁m₂/(m₁ + m₂)) [N s/m].

    With ratio 1 two nodes on a spring are critically damped. Eq. 1 of paper 2 has this force, but its eq. 6, with
    2 sqrt(k (m₁ + m₂))/l, is not in N s/m: it is divided by a length, and contains the sum of the masses instead of
    the reduced mass of the pair. Springs whose ends coincide have no direction and are not damped.
    """

    def __init__(self, springs: Springs, masses: np.ndarray, ratio: float):
        self.pairs = self.couples = springs.pairs
        self.damping = dampings(springs.pairs, springs.stiffness_n_m, masses, ratio)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        _add_force(x, v, self.pairs, self.damping, force)

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        """Add C, which is μ nnᵀ for each spring, to ``values`` (n_blocks, 3, 3) [N s/m]."""
        _add_damping(x, self.pairs, self.damping, slots, values)


@numba.njit(cache=True)
def _add_force(x, v, pairs, damping, force):
    """Add the dampers' forces [N] at ``x`` and velocities ``v`` (n, 3) to ``force`` (n, 3); n : along a spring."""
    n = np.empty(3)
    for e in range(len(pairs)):
        direction(x, pairs[e], n)
        first, second = pairs[e, 0], pairs[e, 1]
        rate = 0.0
        for i in range(3):
            rate += n[i] * (v[second, i] - v[first, i])
        for i in range(3):
            force[first, i] += damping[e] * rate * n[i]
            force[second, i] -= damping[e] * rate * n[i]


@numba.njit(cache=True)
def _add_damping(x, pairs, damping, slots, values):
    n, block = np.empty(3), np.empty((3, 3))
    for e in range(len(pairs)):
        direction(x, pairs[e], n)
        for i in range(3):
            for j in range(3):
                block[i, j] = damping[e] * n[i] * n[j]
        add_pair(slots[e], values, block)
