"""Virtual body springs: every node tied to its rest position, so that a surface resists like a solid."""

import numpy as np

from palpate.bodies.particles import Particles


def make(particles: Particles, settings: dict, elastic: object) -> "BodySprings":
    """Springs of ``stiffness_n_m`` and dampers of ``damping_ratio`` times critical damping, one a node."""
    return BodySprings(particles, settings["stiffness_n_m"], settings["damping_ratio"])


class BodySprings:
    """Springs and dampers of zero rest length to the rest position (paper 3, chapter 3, after Bao et al. 2006).

    The force on a node is −k (x − x₀) − c v with c = 2 ratio sqrt(k m). Trap: it holds on to space, not to the
    body; it resists moving and turning as a whole, and takes momentum out.
    """

    def __init__(self, particles: Particles, stiffness_n_m: float, damping_ratio: float):
        self.couples = np.arange(len(particles.nodes))[:, None]
        self.rest, self.stiffness_n_m = particles.nodes, float(stiffness_n_m)
        self.damping = 2.0 * damping_ratio * np.sqrt(stiffness_n_m * particles.masses)[:, None]

    def energy(self, x: np.ndarray) -> float:
        """Energy of the springs [J] at positions ``x`` (n_nodes, 3) [m]."""
        return 0.5 * self.stiffness_n_m * float(np.sum((x - self.rest) ** 2))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the forces of springs and dampers to ``force`` (n_nodes, 3) [N]."""
        force -= self.stiffness_n_m * (x - self.rest) + self.damping * v

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add k I for each node to ``values`` (n_blocks, 3, 3) [N/m]."""
        values[slots[:, 0, 0]] += self.stiffness_n_m * np.eye(3)

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        """Add c I for each node to ``values`` (n_blocks, 3, 3) [N s/m]."""
        values[slots[:, 0, 0]] += self.damping[:, :, None] * np.eye(3)
