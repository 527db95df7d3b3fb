"""Paper 2's volume force: a tetrahedron resists change of the distances of its corners from its middle."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic: object) -> "Volume":
    """The force with a stiffness of ``stiffness_n_m``; InputError if ``particles`` have no tetrahedra."""
    if not len(particles.tetrahedra):
        raise InputError(
            f"effects of {particles.name} name volume, which needs tetrahedra, and these particles have none; "
            "leave volume out, or use body_springs."
        )
    return Volume(particles, settings["stiffness_n_m"])


class Volume:
    """E = Σ ½ κ (L − L₀)² over tetrahedra, L = Σⱼ‖rⱼ − r_b‖ with the middle r_b = ¼ Σ rⱼ (paper 2, eq. 2).

    The force on corner i is −κ (L − L₀)(uᵢ − ¼ Σ uⱼ), uⱼ the unit vector from the middle to corner j. Three things
    differ from the paper's equation: its sign, which as printed drives a stretched tetrahedron further apart; the
    stiffness κ [N/m], which it lacks; and the term −¼ Σ uⱼ, the middle's own motion, without which the force is not
    the gradient of an energy and the four forces do not cancel, so that the body would push itself along.
    Trap: L is no volume; a tetrahedron can be flattened at the same L. A corner in the middle has no direction, and
    its u and its share of the stiffness are taken to be zero.
    """

    def __init__(self, particles: Particles, stiffness_n_m: float):
        self.tetrahedra = self.couples = np.ascontiguousarray(particles.tetrahedra)
        self.stiffness_n_m = float(stiffness_n_m)
        corners = particles.nodes[self.tetrahedra]
        self.rest_m = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).sum(axis=1)

    def energy(self, x: np.ndarray) -> float:
        """Energy [J] at positions ``x`` (n_nodes, 3) [m]."""
        return _energy(x, self.tetrahedra, self.rest_m, self.stiffness_n_m)

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        """Add minus the energy's gradient to ``force`` (n_nodes, 3) [N]."""
        _add_force(x, self.tetrahedra, self.rest_m, self.stiffness_n_m, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add κ g gᵀ + κ (L − L₀) ∂²L to ``values`` (n_blocks, 3, 3) [N/m], g the gradient of L.

        L is convex; so only where L < L₀ is the second term negative, and ``definite`` leaves it out there.
        """
        _add_stiffness(x, self.tetrahedra, self.rest_m, self.stiffness_n_m, definite, slots, values)


@numba.njit(cache=True)
def _spread(x, corners, lengths, u):
    """L of one tetrahedron; its ``lengths`` (4,) and, per corner, the gradient of L in ``u[4:]``, u in ``u[:4]``."""
    total = 0.0
    for i in range(3):
        middle = 0.25 * (x[corners[0], i] + x[corners[1], i] + x[corners[2], i] + x[corners[3], i])
        for a in range(4):
            u[a, i] = x[corners[a], i] - middle
    for a in range(4):
        lengths[a] = np.sqrt(u[a, 0] ** 2 + u[a, 1] ** 2 + u[a, 2] ** 2)
        total += lengths[a]
        for i in range(3):
            u[a, i] = u[a, i] / lengths[a] if lengths[a] > 0.0 else 0.0
    for i in range(3):
        mean = 0.25 * (u[0, i] + u[1, i] + u[2, i] + u[3, i])
        for a in range(4):
            u[4 + a, i] = u[a, i] - mean
    return total


@numba.njit(cache=True)
def _energy(x, tetrahedra, rest, stiffness):
    lengths, u, total = np.empty(4), np.empty((8, 3)), 0.0
    for e in range(len(tetrahedra)):
        total += 0.5 * stiffness * (_spread(x, tetrahedra[e], lengths, u) - rest[e]) ** 2
    return total


@numba.njit(cache=True)
def _add_force(x, tetrahedra, rest, stiffness, force):
    lengths, u = np.empty(4), np.empty((8, 3))
    for e in range(len(tetrahedra)):
        tension = stiffness * (_spread(x, tetrahedra[e], lengths, u) - rest[e])
        for a in range(4):
            for i in range(3):
                force[tetrahedra[e, a], i] -= tension * u[4 + a, i]


@numba.njit(cache=True)
def _add_stiffness(x, tetrahedra, rest, stiffness, definite, slots, values):
    """∂²L has the blocks δ_ab H_a − ¼ (H_a + H_b) + Σ H/16, H_a = (I − u_a u_aᵀ)/‖r_a − r_b‖."""
    lengths, u = np.empty(4), np.empty((8, 3))
    bend, mean = np.empty((4, 3, 3)), np.empty((3, 3))
    for e in range(len(tetrahedra)):
        tension = stiffness * (_spread(x, tetrahedra[e], lengths, u) - rest[e])
        if definite:
            tension = max(tension, 0.0)
        mean[:] = 0.0
        for a in range(4):
            for i in range(3):
                for j in range(3):
                    across = (1.0 if i == j else 0.0) - u[a, i] * u[a, j]
                    bend[a, i, j] = tension * across / lengths[a] if lengths[a] > 0.0 else 0.0
                    mean[i, j] += bend[a, i, j] / 16.0
        for a in range(4):
            for b in range(4):
                k = slots[e, a, b]
                for i in range(3):
                    for j in range(3):
                        entry = mean[i, j] - 0.25 * (bend[a, i, j] + bend[b, i, j])
                        if a == b:
                            entry += bend[a, i, j]
                        values[k, i, j] += stiffness * u[4 + a, i] * u[4 + b, j] + entry
