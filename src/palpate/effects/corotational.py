"""Corotational linear elasticity on tetrahedra: energy, force and exact or definite stiffness."""

from functools import cached_property

import numba
import numpy as np
from scipy import sparse
from skfem import Basis, ElementTetP1, MeshTet

from palpate.bodies.body import Material
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Energy, Stiffness
from palpate.errors import InputError
from palpate.linalg.block_pattern import BlockPattern, pattern_of
from palpate.linalg.signed_svd import signed_svd

FOLD = 0.05
"""Width over which the fold of the energy is smoothed, in s₂ + s₃ (which is 2 at rest)."""


def make(particles: Particles, settings: dict, elastic: Effect | None = None) -> "Corotational":
    """Make the elasticity of a solid; InputError if ``particles`` have no tetrahedra."""
    if not len(particles.tetrahedra):
        raise InputError(
            f"{particles.name}: corotational elasticity needs tetrahedra, and these particles have none; "
            "name triangles for a sheet, or springs or shape_matching for a surface."
        )
    return Corotational(particles, particles.material)


class Corotational(Energy, Stiffness):
    """Ψ(F) = μ ‖S − I‖² + λ/2 tr²(S − I) with F = R S (Müller and Gross 2004; energy: McAdams et al. 2011).

    Small-strain elasticity in the rotated frame of each element. The force is the exact gradient of the energy, as the
    derivative of the rotation cancels. It is finite for collapsed and inverted elements, and restores them. Trap: where
    an inverted element's rotation jumps (s₂ + s₃ = 0), Ψ has a fold, and an equilibrium without a residual may not
    exist. So the fold is smoothed for s₂ + s₃ < FOLD; elsewhere Ψ is unchanged.
    """

    def __init__(self, mesh: Mesh, material: Material, pattern: BlockPattern | None = None):
        self.tetrahedra = self.couples = np.ascontiguousarray(mesh.tetrahedra)
        self.gradients, self.volumes = shape_gradients(mesh)
        self.moduli = (material.shear_pa, material.lame_pa)
        self._given, self._n_nodes = pattern, len(mesh.nodes)

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of ``stiffness``."""
        return self._given or pattern_of(self.tetrahedra, self._n_nodes)

    def resistance(self) -> np.ndarray:
        """Return an upper bound of the stiffness against the motion of a single node, (n_nodes,) [N/m]."""
        mu, lam = self.moduli
        squares = np.einsum("eaj,eaj->ea", self.gradients, self.gradients) * self.volumes[:, None]
        return (2.0 * mu + lam) * np.bincount(self.tetrahedra.ravel(), squares.ravel(), minlength=self._n_nodes)

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy [J] at positions ``x`` (n_nodes, 3) [m]."""
        return _energy(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli)

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic nodal forces (n_nodes, 3) [N] at positions ``x``: minus the energy's gradient."""
        force = np.zeros((self._n_nodes, 3))
        self.add_force(x, None, force)
        return force

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        """Add the elastic nodal forces to ``force`` (n_nodes, 3) [N]."""
        _add_force(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, force)

    def stiffness(self, x: np.ndarray, definite: bool = False) -> sparse.bsr_array:
        """Return the Hessian of the energy (3 n_nodes, 3 n_nodes) [N/m] in 3 × 3 blocks.

        ``definite`` clamps each element's negative eigenvalues to zero (Smith, de Goes, Kim 2019, section 5).
        """
        values = np.zeros((len(self.pattern.indices), 3, 3))
        self.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], those of element e at ``slots[e]`` (4, 4)."""
        _add_stiffness(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, definite, slots, values)


def shape_gradients(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Compute gradients of the linear shape functions (n_elements, 4, 3) [1/m] and volumes (n_elements,) [m³]."""
    points, cells = np.ascontiguousarray(mesh.nodes.T), np.ascontiguousarray(mesh.tetrahedra.T)
    basis = Basis(MeshTet(points, cells, sort_t=False), ElementTetP1(), intorder=1)
    gradients = np.stack([basis.basis[a][0].grad[:, :, 0].T for a in range(4)], axis=1)
    return np.ascontiguousarray(gradients), np.ascontiguousarray(basis.dx.sum(axis=1))


@numba.njit(cache=True)
def deformation_gradient(x, element, gradients, f):
    """Write the deformation gradient of an element into ``f`` (3, 3)."""
    f[:] = 0.0
    for a in range(4):
        node = element[a]
        for i in range(3):
            for j in range(3):
                f[i, j] += x[node, i] * gradients[a, j]


@numba.njit(cache=True, error_model="numpy")
def _trace(s, mu, lam):
    """Compute tr S with its fold smoothed, T = s₁ + τ(s₂ + s₃), then τ', τ'' and c = ∂Ψ/∂T.

    τ(t) is the C² quartic that meets |t| at t = FOLD. As Ψ = μ (Σs² − 2T + 3) + λ/2 (T − 3)², only T depends on the
    rotation.
    """
    t = s[1] + s[2]
    tau, slope, curvature = t, 1.0, 0.0
    if t < FOLD:
        q = t / FOLD
        tau = FOLD * (3.0 + 6.0 * q * q - q**4) / 8.0
        slope = (3.0 * q - q**3) / 2.0
        curvature = 1.5 * (1.0 - q * q) / FOLD
    trace = s[0] + tau
    return trace, slope, curvature, lam * (trace - 3.0) - 2.0 * mu


@numba.njit(cache=True)
def _energy(x, tetrahedra, gradients, volumes, mu, lam):
    f, u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    total = 0.0
    for e in range(len(tetrahedra)):
        deformation_gradient(x, tetrahedra[e], gradients[e], f)
        signed_svd(f, u, s, v)
        trace, _, _, _ = _trace(s, mu, lam)
        # Σ(s − 1)² exactly, away from the fold: Σs² − 2T + 3 would suffer from cancellation
        squares = (s[0] - 1.0) ** 2 + (s[1] - 1.0) ** 2 + (s[2] - 1.0) ** 2 + 2.0 * (s[0] + (s[1] + s[2]) - trace)
        total += volumes[e] * (mu * squares + 0.5 * lam * (trace - 3.0) ** 2)
    return total


@numba.njit(cache=True)
def _add_force(x, tetrahedra, gradients, volumes, mu, lam, force):
    f, u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for e in range(len(tetrahedra)):
        deformation_gradient(x, tetrahedra[e], gradients[e], f)
        signed_svd(f, u, s, v)
        trace, slope, _, c = _trace(s, mu, lam)
        pressure = lam * (trace - 3.0)
        for k in range(3):  # principal stresses ∂Ψ/∂s
            s[k] = 2.0 * mu * (s[k] - 1.0) + pressure
        s[1] -= (1.0 - slope) * c
        s[2] -= (1.0 - slope) * c
        for i in range(3):
            for j in range(3):  # first Piola–Kirchhoff stress, P = U diag(∂Ψ/∂s) Vᵀ
                f[i, j] = u[i, 0] * s[0] * v[j, 0] + u[i, 1] * s[1] * v[j, 1] + u[i, 2] * s[2] * v[j, 2]
        for a in range(4):
            for i in range(3):
                for j in range(3):
                    force[tetrahedra[e, a], i] -= volumes[e] * f[i, j] * gradients[e, a, j]


@numba.njit(cache=True, error_model="numpy")
def _add_stiffness(x, tetrahedra, gradients, volumes, mu, lam, definite, slots, values):
    """Add element Hessians 2μ I + Σ w M⊗M over a few modes M (Smith, de Goes, Kim 2019, section 5.1)."""
    f, u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    modes, weighted = np.empty((4, 3, 7)), np.empty((4, 3, 7))
    for e in range(len(tetrahedra)):
        deformation_gradient(x, tetrahedra[e], gradients[e], f)
        signed_svd(f, u, s, v)
        count = _low_rank(u, s, v, gradients[e], volumes[e], mu, lam, definite, modes, weighted)
        for a in range(4):
            for b in range(4):
                dot = 0.0
                for j in range(3):
                    dot += gradients[e, a, j] * gradients[e, b, j]
                dot *= 2.0 * mu * volumes[e]
                k = slots[e, a, b]
                for i in range(3):
                    values[k, i, i] += dot
                    for j in range(3):
                        entry = (
                            weighted[a, i, 0] * modes[b, j, 0]
                            + weighted[a, i, 1] * modes[b, j, 1]
                            + weighted[a, i, 2] * modes[b, j, 2]
                            + weighted[a, i, 3] * modes[b, j, 3]
                        )
                        for m in range(4, count):
                            entry += weighted[a, i, m] * modes[b, j, m]
                        values[k, i, j] += entry


@numba.njit(cache=True, error_model="numpy")
def _low_rank(u, s, v, gradients, volume, mu, lam, definite, modes, weighted):
    """Apply the modes of an element's Hessian to the shape gradients, (4 nodes, 3, modes); return their number.

    Mode 0 is the stretch ∂T/∂F, of weight λ. Modes 1 to 3 are the twists T of the planes (2, 3), (3, 1) and (1, 2), of
    weight (∂ᵢΨ + ∂ⱼΨ)/(sᵢ + sⱼ) − 2μ, the only one that can be negative outside the fold. In the fold there are also
    the flips of (3, 1) and (1, 2), and the curvature of the fold itself.
    """
    _, slope, curvature, c = _trace(s, mu, lam)
    for a in range(4):
        g, h, w = 0.0, 0.0, 0.0
        for j in range(3):
            g += v[j, 0] * gradients[a, j]
            h += v[j, 1] * gradients[a, j]
            w += v[j, 2] * gradients[a, j]
        for i in range(3):
            modes[a, i, 0] = u[i, 0] * g + slope * (u[i, 1] * h + u[i, 2] * w)
            modes[a, i, 1] = u[i, 1] * w - u[i, 2] * h
            modes[a, i, 2] = u[i, 2] * g - u[i, 0] * w
            modes[a, i, 3] = u[i, 0] * h - u[i, 1] * g
            modes[a, i, 4] = u[i, 2] * g + u[i, 0] * w
            modes[a, i, 5] = u[i, 0] * h + u[i, 1] * g
            modes[a, i, 6] = u[i, 1] * h + u[i, 2] * w
    weights = (
        lam,
        c * (curvature if s[1] + s[2] <= 0.0 else slope / (s[1] + s[2])),
        0.5 * c * (1.0 + slope) / max(s[2] + s[0], 1e-8),
        0.5 * c * (1.0 + slope) / max(s[0] + s[1], 1e-8),
        0.5 * c * (1.0 - slope) / max(s[0] - s[2], 1e-8),
        0.5 * c * (1.0 - slope) / max(s[0] - s[1], 1e-8),
        c * curvature,
    )
    count = 4 if slope == 1.0 else 7
    for k in range(count):
        weight = weights[k]
        if definite and k > 0:  # every mode except the first has the norm √2
            weight = max(weight, -mu)
        for a in range(4):
            for i in range(3):
                weighted[a, i, k] = volume * weight * modes[a, i, k]
    return count
