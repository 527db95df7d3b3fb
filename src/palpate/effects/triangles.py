"""Constant-strain triangles with a thickness: resistance of a sheet to stretch and shear."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Energy, Stiffness
from palpate.linalg.polar import signed_svd

FOLD = 0.05
"""Width over which the energy's peak at a collapsed triangle is smoothed, in the singular value (1 at rest)."""


def make(particles: Particles, settings: object, elastic: Effect | None = None) -> "Triangles":
    """Make the membrane of a sheet."""
    return Triangles(particles)


class Triangles(Energy, Stiffness):
    """Membrane, E = Σ t A (μ Σ (σ − 1)² + λₚ/2 (σ₁ + σ₂ − 2)²), σ the singular values of F (3, 2) (paper 3, chapter 3).

    The constant-strain triangle in plane stress, λₚ = 2λμ/(λ + 2μ), in the rotated frame of each triangle. The force is
    the exact gradient. Trap: at a triangle collapsed to a line or a point the energy has a conical peak, since σ cannot
    be negative (a sheet has no inside); it is smoothed for σ < FOLD, and unchanged elsewhere. There is no resistance to
    bending, for which there is the effect bending.
    """

    def __init__(self, particles: Particles):
        self.couples = np.ascontiguousarray(particles.triangles)
        self.gradients, areas = shape_gradients(particles.nodes, particles.triangles)
        self.volumes = particles.thickness_m * areas
        mu, lam = particles.material.shear_pa, particles.material.lame_pa
        self.moduli = (mu, 2.0 * lam * mu / (lam + 2.0 * mu))

    def energy(self, x: np.ndarray) -> float:
        return _energy_and_force(x, self.couples, self.gradients, self.volumes, *self.moduli, np.zeros_like(x))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        _energy_and_force(x, self.couples, self.gradients, self.volumes, *self.moduli, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks [N/m]; ``definite`` clamps each triangle's negative eigenvalues to zero."""
        _add_stiffness(x, self.couples, self.gradients, self.volumes, *self.moduli, definite, slots, values)


def shape_gradients(nodes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute gradients of the linear shape functions (t, 3, 2) [1/m] and areas (t,) [m²] of triangles (t, 3).

    The gradients are in the plane of each triangle, the first axis along its first edge.
    """
    edge, side = nodes[triangles[:, 1]] - nodes[triangles[:, 0]], nodes[triangles[:, 2]] - nodes[triangles[:, 0]]
    length = np.linalg.norm(edge, axis=1)
    along = np.einsum("ti,ti->t", edge, side) / length
    height = np.linalg.norm(np.cross(edge, side), axis=1) / length
    gradients = np.zeros((len(triangles), 3, 2))
    gradients[:, 1, 0] = 1.0 / length
    gradients[:, 1, 1] = -along / (length * height)
    gradients[:, 2, 1] = 1.0 / height
    gradients[:, 0] = -gradients[:, 1] - gradients[:, 2]
    return gradients, 0.5 * length * height


@numba.njit(cache=True)
def _deformation_gradient(x, triangle, gradients, f):
    """Write F into the first two columns of ``f``; with a third of zeros, the last axis of U is the normal."""
    f[:] = 0.0
    for a in range(3):
        for i in range(3):
            for j in range(2):
                f[i, j] += x[triangle[a], i] * gradients[a, j]


@numba.njit(cache=True, error_model="numpy")
def _round(s):
    """Return τ, τ', τ'' and τ'/s of |s| with its kink at 0 smoothed, by the C² quartic that meets |s| at FOLD."""
    if s >= FOLD:
        return s, 1.0, 0.0, 1.0 / s
    q = s / FOLD
    secant = (3.0 - q * q) / (2.0 * FOLD)
    return FOLD * (3.0 + 6.0 * q * q - q**4) / 8.0, s * secant, 1.5 * (1.0 - q * q) / FOLD, secant


@numba.njit(cache=True)
def _energy_and_force(x, triangles, gradients, volumes, mu, lam, force):
    """Add the nodal forces [N] to ``force`` (n, 3) and return the energy [J]."""
    f, u, v, s, total = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), 0.0
    for e in range(len(triangles)):
        _deformation_gradient(x, triangles[e], gradients[e], f)
        signed_svd(f, u, s, v)
        tau1, tau2 = _round(s[0]), _round(s[1])
        trace = tau1[0] + tau2[0]
        # Σ(s − 1)² exactly, away from the peak: Σs² − 2T + 2 would suffer from cancellation
        squares = (s[0] - 1.0) ** 2 + (s[1] - 1.0) ** 2 + 2.0 * (s[0] + s[1] - trace)
        total += volumes[e] * (mu * squares + 0.5 * lam * (trace - 2.0) ** 2)
        pressure = lam * (trace - 2.0)
        # principal stresses ∂Ψ/∂s = 2μ (s − τ') + pressure τ'
        stress1 = 2.0 * mu * (s[0] - tau1[1]) + pressure * tau1[1]
        stress2 = 2.0 * mu * (s[1] - tau2[1]) + pressure * tau2[1]
        for a in range(3):
            pull1 = volumes[e] * stress1 * (v[0, 0] * gradients[e, a, 0] + v[1, 0] * gradients[e, a, 1])
            pull2 = volumes[e] * stress2 * (v[0, 1] * gradients[e, a, 0] + v[1, 1] * gradients[e, a, 1])
            for i in range(3):
                force[triangles[e, a], i] -= u[i, 0] * pull1 + u[i, 1] * pull2
    return total


@numba.njit(cache=True, error_model="numpy")
def _add_stiffness(x, triangles, gradients, volumes, mu, lam, definite, slots, values):
    """Add element Hessians Σ w M⊗M over six orthonormal modes M, which are their eigenvectors."""
    f, u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    modes, weights = np.empty((3, 3, 6)), np.empty(6)
    for e in range(len(triangles)):
        _deformation_gradient(x, triangles[e], gradients[e], f)
        signed_svd(f, u, s, v)
        cosine, sine = _eigenvalues(s, mu, lam, weights)
        _modes(u, v, gradients[e], cosine, sine, modes)
        for k in range(6):
            if definite:
                weights[k] = max(weights[k], 0.0)
            weights[k] *= volumes[e]
        for a in range(3):
            for b in range(3):
                slot = slots[e, a, b]
                for i in range(3):
                    for j in range(3):
                        entry = 0.0
                        for k in range(6):
                            entry += weights[k] * modes[a, i, k] * modes[b, j, k]
                        values[slot, i, j] += entry


@numba.njit(cache=True, error_model="numpy")
def _eigenvalues(s, mu, lam, weights):
    """Compute the eigenvalues of ∂²Ψ/∂F² in the order of ``_modes``; return the first mode's direction in (s₁, s₂).

    They are two stretches, the twist and the flip of the plane, and two rotations out of it (Smith, de Goes, Kim 2019,
    section 5, for F of two columns). ∂²Ψ/∂s² is [[a, b], [b, d]].
    """
    (t1, slope1, bend1, secant1), (t2, slope2, bend2, secant2) = _round(s[0]), _round(s[1])
    c = lam * (t1 + t2 - 2.0) - 2.0 * mu
    a = 2.0 * mu + lam * slope1 * slope1 + c * bend1
    d = 2.0 * mu + lam * slope2 * slope2 + c * bend2
    b = lam * slope1 * slope2
    angle = 0.5 * np.arctan2(2.0 * b, a - d)
    radius = np.hypot(0.5 * (a - d), b)
    weights[0], weights[1] = 0.5 * (a + d) + radius, 0.5 * (a + d) - radius
    if s[0] < FOLD:  # divided differences of τ', without cancellation
        p, q = s[0] / FOLD, s[1] / FOLD
        twist = (3.0 - (p * p - p * q + q * q)) / (2.0 * FOLD)
        flip = (3.0 - (p * p + p * q + q * q)) / (2.0 * FOLD)
    else:
        twist = (slope1 + slope2) / (s[0] + s[1])
        flip = (slope1 - slope2) / (s[0] - s[1]) if slope2 < 1.0 else 0.0
    weights[2], weights[3] = 2.0 * mu + c * twist, 2.0 * mu + c * flip
    weights[4], weights[5] = 2.0 * mu + c * secant1, 2.0 * mu + c * secant2
    return np.cos(angle), np.sin(angle)


@numba.njit(cache=True)
def _modes(u, v, gradients, cosine, sine, modes):
    """Write the products of the six modes with the shape gradients of three nodes to ``modes`` (3, 3, 6)."""
    factor = np.sqrt(0.5)
    for a in range(3):
        g = v[0, 0] * gradients[a, 0] + v[1, 0] * gradients[a, 1]
        h = v[0, 1] * gradients[a, 0] + v[1, 1] * gradients[a, 1]
        for i in range(3):
            modes[a, i, 0] = cosine * u[i, 0] * g + sine * u[i, 1] * h
            modes[a, i, 1] = cosine * u[i, 1] * h - sine * u[i, 0] * g
            modes[a, i, 2] = factor * (u[i, 0] * h - u[i, 1] * g)
            modes[a, i, 3] = factor * (u[i, 0] * h + u[i, 1] * g)
            modes[a, i, 4] = u[i, 2] * g
            modes[a, i, 5] = u[i, 2] * h
