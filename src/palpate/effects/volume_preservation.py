"""Springs that resist a change of volume: the volume force of paper 2, not a load per volume.

It acts on the sum of the distances of a tetrahedron's corners from its middle.
"""

import numba
import numpy as np

from palpate.bodies.particles import Particles, default_stiffness
from palpate.effects import settings
from palpate.effects.effect import Effect, Energy, Stiffness


def make(particles: Particles, volume: settings.Volume, elastic: Effect | None) -> "Volume":
    """Make the force of a solid, of ``stiffness_n_m`` (default: ``default_stiffness``)."""
    given = volume.stiffness_n_m
    return Volume(particles, default_stiffness(particles) if given is None else given)


class Volume(Energy, Stiffness):
    """Springs with E = Σ ½ κ (L − L₀)² over tetrahedra, L = Σⱼ‖rⱼ − r_b‖ to their middle r_b = ¼ Σ rⱼ (paper 2, eq. 2).

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
        return _energy(x, self.tetrahedra, self.rest_m, self.stiffness_n_m)

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
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
    """Add −κ (L − L₀)(uᵢ − ¼ Σ uⱼ) to ``force`` (n, 3) [N]."""
    add_forces(x, tetrahedra, rest, stiffness, force, np.empty(12), (0,))


@numba.njit(cache=True, error_model="numpy")
def add_forces(x, tetrahedra, rest, stiffness, force, pulls, lanes):
    """Do what ``add_force`` does for k = len(lanes) bodies at once: ``x``, ``force`` (n, 3k), all x, then all y and z.

    pulls : (12k,) scratch, which separates reads from writes, so that vector instructions work on one body each; the
        calibration of springs spends most of its time here
    """
    k = len(lanes)
    for e in range(len(tetrahedra)):
        a, b, c, d = tetrahedra[e, 0], tetrahedra[e, 1], tetrahedra[e, 2], tetrahedra[e, 3]
        xa, xb, xc, xd = x[a], x[b], x[c], x[d]
        for i in range(k):
            m0 = 0.25 * (xa[i] + xb[i] + xc[i] + xd[i])
            m1 = 0.25 * (xa[k + i] + xb[k + i] + xc[k + i] + xd[k + i])
            m2 = 0.25 * (xa[2 * k + i] + xb[2 * k + i] + xc[2 * k + i] + xd[2 * k + i])
            a0, a1, a2, length_a = _from_middle(xa[i] - m0, xa[k + i] - m1, xa[2 * k + i] - m2)
            b0, b1, b2, length_b = _from_middle(xb[i] - m0, xb[k + i] - m1, xb[2 * k + i] - m2)
            c0, c1, c2, length_c = _from_middle(xc[i] - m0, xc[k + i] - m1, xc[2 * k + i] - m2)
            d0, d1, d2, length_d = _from_middle(xd[i] - m0, xd[k + i] - m1, xd[2 * k + i] - m2)
            tension = stiffness * (length_a + length_b + length_c + length_d - rest[e])
            s0, s1, s2 = 0.25 * (a0 + b0 + c0 + d0), 0.25 * (a1 + b1 + c1 + d1), 0.25 * (a2 + b2 + c2 + d2)
            pulls[i], pulls[k + i], pulls[2 * k + i] = tension * (a0 - s0), tension * (a1 - s1), tension * (a2 - s2)
            pulls[3 * k + i], pulls[4 * k + i] = tension * (b0 - s0), tension * (b1 - s1)
            pulls[5 * k + i], pulls[6 * k + i] = tension * (b2 - s2), tension * (c0 - s0)
            pulls[7 * k + i], pulls[8 * k + i] = tension * (c1 - s1), tension * (c2 - s2)
            pulls[9 * k + i], pulls[10 * k + i] = tension * (d0 - s0), tension * (d1 - s1)
            pulls[11 * k + i] = tension * (d2 - s2)
        for corner in range(4):
            pulled, start = force[tetrahedra[e, corner]], 3 * k * corner
            for i in range(3 * k):
                pulled[i] -= pulls[start + i]


@numba.njit(cache=True, error_model="numpy")
def _from_middle(u0, u1, u2):
    length = np.sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    inverse = 1.0 / length if length > 0.0 else 0.0
    return u0 * inverse, u1 * inverse, u2 * inverse, length


@numba.njit(cache=True)
def _add_stiffness(x, tetrahedra, rest, stiffness, definite, slots, values):
    """Add the Hessian κ ∂L ∂Lᵀ + κ (L − L₀) ∂²L to ``values`` (k, 3, 3) [N/m], of tetrahedron e at ``slots[e]`` (4, 4).

    ∂²L has the blocks δ_ab H_a − ¼ (H_a + H_b) + Σ H/16, H_a = (I − u_a u_aᵀ)/‖r_a − r_m‖, with the middle r_m.
    definite : whether to leave out the second term where L < L₀
    """
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
