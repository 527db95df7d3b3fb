"""Coulomb friction as a potential: smooth at rest, with the directions and normal forces of an earlier state."""

import numba
import numpy as np

from palpate.collision.contact.barrier import acts, barrier, mollifier
from palpate.collision.triangles.closest_points import closest_points


class LaggedFriction:
    """Σ μ λ f₀(|u|), where u is the tangential part of Σ wᵢ (xᵢ − startᵢ) with w, normals and λ of an earlier state.

    f₀(u) = u²/ε − u³/(3 ε²) for u < ε, u − ε/3 beyond it (Li et al. 2020, eq. 14–17, without the constant, which has no
    force): friction is at its limit from ε = ``slip_m`` on; IPC's is a speed times the length of the step. A normal
    force is the barrier's, m scale |b′| (eq. 13); stencils without one are left out.

    stencils : the first seven arguments of barrier.energy, in their state at ``x`` (n, 3) [m]; friction : coefficient μ;
    slip_m : > 0 [m]; start : (n, 3) [m]
    rows : (a,) of the active stencils; nodes, weights : (a, 4); normals : (a, 3); forces : (a,) λ [N];
    limits : (a,) μ λ [N]
    Traps: below the limit contacts creep; and friction with the directions and forces of an earlier state has the error
    of their change since: lag and solve again until they no longer change.
    """

    def __init__(self, stencils: tuple, x: np.ndarray, friction: float, slip_m: float, start: np.ndarray):
        kinds, nodes, offsets, scales, mollify, gap, soft = stencils
        distance, weights, normals = closest_points(kinds, nodes, x)
        forces = _normal_forces(nodes, (distance - offsets) / gap, scales, mollify, soft, x)
        self.rows = np.flatnonzero(forces > 0.0)
        self.nodes, self.weights, self.normals = nodes[self.rows], weights[self.rows], normals[self.rows]
        self.forces, self.limits = forces[self.rows], friction * forces[self.rows]
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


@numba.njit(cache=True, error_model="numpy")
def _normal_forces(nodes, levels, scales, mollify, soft, x):
    gradient, forces = np.empty((4, 3)), np.zeros(len(nodes))
    for k in range(len(nodes)):
        if acts(levels[k], soft, 1.0):
            forces[k] = -scales[k] * mollifier(x, nodes[k], mollify[k], gradient)[0] * barrier(levels[k], soft)[1]
    return forces


@numba.njit(cache=True)
def _tangential_motion(nodes, weights, normal, x, start, u):
    """Write the tangential part of Σ wᵢ (xᵢ − startᵢ) to ``u`` (3,), and return its length [m]."""
    for i in range(3):
        u[i] = 0.0
        for a in range(4):
            u[i] += weights[a] * (x[nodes[a], i] - start[nodes[a], i])
    along = u[0] * normal[0] + u[1] * normal[1] + u[2] * normal[2]
    for i in range(3):
        u[i] -= along * normal[i]
    return np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@numba.njit(cache=True, error_model="numpy")
def _resistance(length, slip):
    """Compute f₀′(u)/u, and its derivative by u divided by u."""
    if length < slip:
        return (2.0 - length / slip) / slip, -1.0 / (slip * slip * length) if length > 0.0 else 0.0
    return 1.0 / length, -1.0 / length**3


@numba.njit(cache=True, error_model="numpy")
def energy(nodes, weights, normals, limits, slip, x, start):
    u, total = np.empty(3), 0.0
    for k in range(len(nodes)):
        length = _tangential_motion(nodes[k], weights[k], normals[k], x, start, u)
        if length < slip:
            total += limits[k] * length * length / slip * (1.0 - length / (3.0 * slip))
        else:
            total += limits[k] * (length - slip / 3.0)
    return total


@numba.njit(cache=True)
def add_force(nodes, weights, normals, limits, slip, x, start, force):
    u = np.empty(3)
    for k in range(len(nodes)):
        resistance = limits[k] * _resistance(_tangential_motion(nodes[k], weights[k], normals[k], x, start, u), slip)[0]
        for a in range(4):
            for i in range(3):
                force[nodes[k, a], i] -= resistance * weights[k, a] * u[i]


@numba.njit(cache=True)
def blocks(nodes, weights, normals, limits, slip, x, start, definite):
    u, out = np.empty(3), np.empty((len(nodes), 4, 4, 3, 3))
    for k in range(len(nodes)):
        length = _tangential_motion(nodes[k], weights[k], normals[k], x, start, u)
        resistance, change = _resistance(length, slip)
        if definite:
            change = 0.0
        for i in range(3):
            for j in range(3):
                across = (1.0 if i == j else 0.0) - normals[k, i] * normals[k, j]
                value = limits[k] * (resistance * across + change * u[i] * u[j])
                for a in range(4):
                    for b in range(4):
                        out[k, a, b, i, j] = value * weights[k, a] * weights[k, b]
    return out
