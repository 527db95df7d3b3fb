"""The volume force of paper 2: resistance of a tetrahedron to changes of its corners' distances from its middle."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Energy, Stiffness
from palpate.effects.spring_network import edge_stiffness
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic: Effect | None) -> "Volume":
    """Make the force, of ``stiffness_n_m`` (default: that of an edge); InputError without tetrahedra."""
    if not len(particles.tetrahedra):
        raise InputError(
            f"effects of {particles.name} name volume, which needs tetrahedra, and these particles have none; "
            "leave volume out, or use body_springs."
        )
    return Volume(particles, settings["stiffness_n_m"] if "stiffness_n_m" in settings else edge_stiffness(particles))


class Volume(Energy, Stiffness):
    """E = Σ ½ κ (L − L₀)² over tetrahedra, L = Σⱼ‖rⱼ − r_b‖ with the middle r_b = ¼ Σ rⱼ (paper 2, eq. 2).

    The force on corner i is −κ (L − L₀)(uᵢ − ¼ Σ uⱼ), uⱼ the unit vector from the middle to corner j. It differs from
    the paper's equation in three points: the sign, which as printed stretches a stretched tetrahedron further; the
    stiffness κ [N/m], which the paper lacks; and the term −¼ Σ uⱼ, the motion of the middle, without which the force is
    not the gradient of an energy and the four forces do not sum to zero, so that the body would accelerate itself.
    Trap: L is not a volume; a tetrahedron can become flat at the same L. A corner at the middle has no direction, and
    its u and its part of the stiffness are set to zero.
    """

    def __init__(self, particles: Particles, stiffness_n_m: float):
        self.tetrahedra = self.couples = np.ascontiguousarray(particles.tetrahedra)
        self.stiffness_n_m = float(stiffness_n_m)
        self.rest_m = rest_distance_sum(particles.nodes, self.tetrahedra)

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] at positions ``x`` (n_nodes, 3) [m]."""
        return _energy(x, self.tetrahedra, self.rest_m, self.stiffness_n_m)

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        """Add minus the energy's gradient to ``force`` (n_nodes, 3) [N]."""
        add_force(x, self.tetrahedra, self.rest_m, self.stiffness_n_m, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add κ g gᵀ + κ (L − L₀) ∂²L to ``values`` (n_blocks, 3, 3) [N/m], g the gradient of L.

        L is convex, so the second term is negative only for L < L₀, where ``definite`` omits it.
        """
        _add_stiffness(x, self.tetrahedra, self.rest_m, self.stiffness_n_m, definite, slots, values)


def rest_distance_sum(nodes: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Compute L₀ (m,) [m] of ``tetrahedra`` (m, 4) whose ``nodes`` (n, 3) [m] are at rest."""
    corners = nodes[tetrahedra]
    return np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).sum(axis=1)


@numba.njit(cache=True)
def distance_sum(x, corners, lengths, u):
    """Return L of one tetrahedron; write the distances into ``lengths`` (4,), u into ``u[:4]``, ∂L into ``u[4:]``."""
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
        total += 0.5 * stiffness * (distance_sum(x, tetrahedra[e], lengths, u) - rest[e]) ** 2
    return total


@numba.njit(cache=True, error_model="numpy")
def add_force(x, tetrahedra, rest, stiffness, force):
    """Add −κ (L − L₀)(uᵢ − ¼ Σ uⱼ) to ``force`` (n, 3) [N].

    The loops are unrolled, with one root and one division for each corner, as the calibration spends most of its time
    here.
    """
    for e in range(len(tetrahedra)):
        a, b, c, d = tetrahedra[e, 0], tetrahedra[e, 1], tetrahedra[e, 2], tetrahedra[e, 3]
        m0 = 0.25 * (x[a, 0] + x[b, 0] + x[c, 0] + x[d, 0])
        m1 = 0.25 * (x[a, 1] + x[b, 1] + x[c, 1] + x[d, 1])
        m2 = 0.25 * (x[a, 2] + x[b, 2] + x[c, 2] + x[d, 2])
        a0, a1, a2, length_a = _from_middle(x, a, m0, m1, m2)
        b0, b1, b2, length_b = _from_middle(x, b, m0, m1, m2)
        c0, c1, c2, length_c = _from_middle(x, c, m0, m1, m2)
        d0, d1, d2, length_d = _from_middle(x, d, m0, m1, m2)
        tension = stiffness * (length_a + length_b + length_c + length_d - rest[e])
        s0, s1, s2 = 0.25 * (a0 + b0 + c0 + d0), 0.25 * (a1 + b1 + c1 + d1), 0.25 * (a2 + b2 + c2 + d2)
        _pull(force, a, tension, a0 - s0, a1 - s1, a2 - s2)
        _pull(force, b, tension, b0 - s0, b1 - s1, b2 - s2)
        _pull(force, c, tension, c0 - s0, c1 - s1, c2 - s2)
        _pull(force, d, tension, d0 - s0, d1 - s1, d2 - s2)


@numba.njit(cache=True, error_model="numpy")
def _from_middle(x, corner, m0, m1, m2):
    u0, u1, u2 = x[corner, 0] - m0, x[corner, 1] - m1, x[corner, 2] - m2
    length = np.sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    inverse = 1.0 / length if length > 0.0 else 0.0
    return u0 * inverse, u1 * inverse, u2 * inverse, length


@numba.njit(cache=True)
def _pull(force, corner, tension, g0, g1, g2):
    force[corner, 0] -= tension * g0
    force[corner, 1] -= tension * g1
    force[corner, 2] -= tension * g2


@numba.njit(cache=True)
def _add_stiffness(x, tetrahedra, rest, stiffness, definite, slots, values):
    """Add the Hessian; ∂²L has the blocks δ_ab H_a − ¼ (H_a + H_b) + Σ H/16, H_a = (I − u_a u_aᵀ)/‖r_a − r_b‖."""
    lengths, u = np.empty(4), np.empty((8, 3))
    bend, mean = np.empty((4, 3, 3)), np.empty((3, 3))
    for e in range(len(tetrahedra)):
        tension = stiffness * (distance_sum(x, tetrahedra[e], lengths, u) - rest[e])
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
