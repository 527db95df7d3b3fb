"""Rayleigh damping: in proportion to mass and to stiffness."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError
from palpate.linalg.block_pattern import scatter


def make(particles: Particles, settings: dict, elastic) -> "Rayleigh":
    """C from ``mass_1_s`` [1/s] and ``stiffness_s`` [s]; InputError if ``elastic`` has no stiffness to share in."""
    stiffness = settings["stiffness_s"]
    if stiffness > 0.0 and not hasattr(elastic, "add_stiffness"):
        raise InputError(
            f"{particles.name}: rayleigh.stiffness_s is {stiffness:g}, and the elastic effect has no stiffness matrix; "
            "set it to 0, or choose corotational, triangles or springs."
        )
    return Rayleigh(particles.masses, settings["mass_1_s"], stiffness, elastic)


class Rayleigh:
    """C(x) = mass_1_s M + stiffness_s K(x), where K is the elastic effect's Hessian, clamped to positive semidefinite.

    ``couples`` are those of the elastic effect, and each node's mass is shared evenly among its elements. The mass's
    part damps flight and rotation too; the stiffness's part leaves both alone, except rotation of a body under
    stress. Trap: for an explicit integrator ``add_force`` assembles all element matrices in every step, slow but
    right, and the damping shortens its stable step.
    """

    def __init__(self, masses: np.ndarray, mass_rate: float, stiffness_time: float, elastic):
        self._time, self._elastic = stiffness_time, elastic
        self.couples = elastic.couples if stiffness_time > 0.0 else np.arange(len(masses))[:, None]
        count = np.bincount(self.couples.ravel(), minlength=len(masses))
        self._shares = (mass_rate * masses / np.maximum(count, 1))[self.couples]
        m, k = self.couples.shape
        self._slots = np.arange(m * k * k, dtype=np.int32).reshape(m, k, k)
        self._blocks = np.zeros((m * k * k, 3, 3))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add −C(x) v to ``force`` (n, 3) [N]; ``x`` (n, 3) [m], ``v`` (n, 3) [m/s]."""
        self._assemble(x)
        _subtract_products(self.couples, self._blocks, v, force)

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        """Add C's blocks [N s/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (k, k)."""
        self._assemble(x)
        scatter(slots.ravel(), self._blocks, values)

    def _assemble(self, x: np.ndarray) -> None:
        """C at ``x``, element by element: one block for each of ``_slots``."""
        self._blocks[:] = 0.0
        if self._time > 0.0:
            self._elastic.add_stiffness(x, True, self._slots, self._blocks)
            self._blocks *= self._time
        places = np.diagonal(self._slots, axis1=1, axis2=2)
        for i in range(3):
            self._blocks[places, i, i] += self._shares


@numba.njit(cache=True)
def _subtract_products(couples, blocks, v, force):
    m, size = couples.shape
    for e in range(m):
        for a in range(size):
            for b in range(size):
                k = (e * size + a) * size + b
                for i in range(3):
                    for j in range(3):
                        force[couples[e, a], i] -= blocks[k, i, j] * v[couples[e, b], j]
