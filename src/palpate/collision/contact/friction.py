"""Coulomb friction as a potential that is smooth at rest, with the directions and normal forces of an earlier state.

``law`` and ``tangential`` are those of all contact: of stencils of four nodes of the barrier, here, and of points on
rigid instruments, in ``instrument_contact``.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.collision.contact.barrier import barrier, mollifier
from palpate.collision.triangles.closest_points import boxes_apart, closest, separation


class LaggedFriction:
    """Friction with E = Σ μ λ f₀(|u|), u tangential of Σ wᵢ (xᵢ − startᵢ), and w, normals and λ of an earlier state.

    f₀(u) = u²/ε − u³/(3 ε²) for u < ε, and u − ε/3 beyond (Li et al. 2020, eq. 14–17, without the constant, which has
    no force): friction is at its limit from ε = ``slip_m`` on, in a step a speed times its length. The normal force λ
    is that of the barrier, m scale |b′| (eq. 13); stencils without one are left out.

    stencils : the first six arguments of barrier.energy, in their state at ``x`` (n, 3) [m]
    friction : coefficient μ; slip_m : > 0 [m]; start : (n, 3) [m]
    rows : (a,) of the active stencils; nodes, weights : (a, 4); normals : (a, 3); forces, limits : (a,) λ, μ λ [N]
    Traps: below the limit contacts creep; and friction with the directions and forces of an earlier state has the error
    of their change since: lag and solve again until they no longer change.
    """

    def __init__(self, stencils: tuple, x: np.ndarray, friction: float, slip_m: float, start: np.ndarray):
        kinds, nodes, offsets, scales, mollify, gap = stencils
        active = pressing(kinds, nodes, offsets, scales, mollify, gap, x)
        self.rows, self.nodes, self.weights, self.normals, self.forces = active
        self.limits = friction * self.forces
        self._state = (self.nodes, self.weights, self.normals, self.limits, slip_m)
        self._start = start.copy()

    def energy(self, x: np.ndarray) -> float:
        return energy(*self._state, x, self._start)

    def add_force(self, x: np.ndarray, force: np.ndarray) -> None:
        add_force(*self._state, x, self._start, force)

    def blocks(self, x: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray]:
        """Compute nodes (a, 4) and second derivatives (a, 4, 4, 3, 3) [N/m].

        Exact, or with ``definite`` those of the parabola in |u| that touches the energy at x and is nowhere below it.
        Both are positive semi-definite. Trap: a sliding contact has no curvature along its direction, so a step with
        the exact ones goes far beyond where it should stick; with the parabola's it gets there in few steps.
        """
        return self.nodes, blocks(*self._state, x, self._start, definite)


class Rubbing(NamedTuple):
    """Friction of q points on k rigid instruments in a step, as the kernels take it.

    normals : (k, q, 3); limits : (k, q) μ λ [N]; slip : [m], from which friction is at its limit
    start : (q, 3) [m], points at the start of the step; shifts : (k, 3) [m], displacements of the instruments in it
    """

    normals: np.ndarray
    limits: np.ndarray
    slip: float
    start: np.ndarray
    shifts: np.ndarray


@numba.njit(cache=True, error_model="numpy")
def pressing(kinds, nodes, offsets, scales, mollify, gap, x):
    """Return rows (a,), nodes (a, 4), weights (a, 4), normals (a, 3) and forces (a,) [N] of the stencils that press."""
    count, gradient = 0, np.empty((4, 3))
    rows, weights = np.empty(len(kinds), np.int64), np.empty((len(kinds), 4))
    normals, forces = np.empty((len(kinds), 3)), np.empty(len(kinds))
    for k in range(len(kinds)):
        if boxes_apart(kinds[k], x, nodes[k], offsets[k] + gap):
            continue
        distance, _ = closest(kinds[k], x, nodes[k], weights[count])
        s = (distance - offsets[k]) / gap
        if not 0.0 < s < 1.0:
            continue
        force = -scales[k] * mollifier(x, nodes[k], mollify[k], gradient)[0] * barrier(s)[1]
        if force > 0.0:
            normals[count] = np.array(separation(x, nodes[k], weights[count])) / distance
            rows[count], forces[count] = k, force
            count += 1
    return rows[:count], nodes[rows[:count]], weights[:count].copy(), normals[:count], forces[:count]


@numba.njit(cache=True)
def tangential(u, normal):
    """Replace ``u`` (3,) [m] by its tangential part, and return the length of that [m]."""
    through = u[0] * normal[0] + u[1] * normal[1] + u[2] * normal[2]
    for i in range(3):
        u[i] -= through * normal[i]
    return np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@numba.njit(cache=True)
def _slide(nodes, weights, normal, x, start, u):
    """Write the tangential part of Σ wᵢ (xᵢ − startᵢ) to ``u`` (3,), and return its length [m]."""
    for i in range(3):
        u[i] = 0.0
        for a in range(4):
            u[i] += weights[a] * (x[nodes[a], i] - start[nodes[a], i])
    return tangential(u, normal)


@numba.njit(cache=True, error_model="numpy")
def law(length, slip):
    """Compute f₀(u), f₀′(u)/u, and the latter's derivative by u divided by u."""
    if length < slip:
        potential = length * length / slip * (1.0 - length / (3.0 * slip))
        return potential, (2.0 - length / slip) / slip, -1.0 / (slip * slip * length) if length > 0.0 else 0.0
    return length - slip / 3.0, 1.0 / length, -1.0 / length**3


@numba.njit(cache=True)
def energy(nodes, weights, normals, limits, slip, x, start):
    u, total = np.empty(3), 0.0
    for k in range(len(nodes)):
        total += limits[k] * law(_slide(nodes[k], weights[k], normals[k], x, start, u), slip)[0]
    return total


@numba.njit(cache=True)
def add_force(nodes, weights, normals, limits, slip, x, start, force):
    u = np.empty(3)
    for k in range(len(nodes)):
        resistance = limits[k] * law(_slide(nodes[k], weights[k], normals[k], x, start, u), slip)[1]
        for a in range(4):
            for i in range(3):
                force[nodes[k, a], i] -= resistance * weights[k, a] * u[i]


@numba.njit(cache=True)
def blocks(nodes, weights, normals, limits, slip, x, start, definite):
    """Return the Hessians (a, 4, 4, 3, 3) [N/m] of friction at ``x`` by stencils' nodes; u : slip since ``start``."""
    u, hessians = np.empty(3), np.empty((len(nodes), 4, 4, 3, 3))
    for k in range(len(nodes)):
        _, resistance, slope = law(_slide(nodes[k], weights[k], normals[k], x, start, u), slip)
        if definite:
            slope = 0.0
        for i in range(3):
            for j in range(3):
                across = (1.0 if i == j else 0.0) - normals[k, i] * normals[k, j]
                value = limits[k] * (resistance * across + slope * u[i] * u[j])
                for a in range(4):
                    for b in range(4):
                        hessians[k, a, b, i, j] = value * weights[k, a] * weights[k, b]
    return hessians
