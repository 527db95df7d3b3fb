"""Virtual body springs: each node is tied to its rest position, so that a surface resists like a solid."""

import numpy as np

from palpate.bodies.particles import Particles, default_stiffness
from palpate.effects import settings
from palpate.effects.effect import Damping, Effect, Energy, Stiffness


def make(particles: Particles, springs: settings.BodySprings, elastic: Effect | None) -> "BodySprings":
    """Make a spring and a damper for each node.

    settings : ``stiffness_n_m`` (default: ``default_stiffness``); ``damping_ratio``, relative to critical damping
    """
    stiffness = default_stiffness(particles) if springs.stiffness_n_m is None else springs.stiffness_n_m
    return BodySprings(particles, stiffness, springs.damping_ratio)


class BodySprings(Energy, Stiffness, Damping):
    """Springs and dampers of zero rest length to the rest position (paper 3, chapter 3, after Bao et al. 2006).

    The force on a node is −k (x − x₀) − c v with c = 2 ratio sqrt(k m). Trap: it ties the body to space, so it resists
    translation and rotation of the whole body, and does not conserve momentum.
    """

    def __init__(self, particles: Particles, stiffness_n_m: float, damping_ratio: float):
        self.couples = np.arange(len(particles.nodes))[:, None]
        self.rest, self.stiffness_n_m = particles.nodes, float(stiffness_n_m)
        self.damping = 2.0 * damping_ratio * np.sqrt(stiffness_n_m * particles.masses)[:, None]

    def energy(self, x: np.ndarray) -> float:
        return 0.5 * self.stiffness_n_m * float(np.sum((x - self.rest) ** 2))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force -= self.stiffness_n_m * (x - self.rest) + self.damping * v

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        values[slots[:, 0, 0]] += self.stiffness_n_m * np.eye(3)

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        values[slots[:, 0, 0]] += self.damping[:, :, None] * np.eye(3)
