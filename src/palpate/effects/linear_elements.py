"""Elasticity of four-node tetrahedra: energy and force in one pass over the elements, stiffness in another.

``mu, lam`` (n_elements,) are their moduli [Pa]; ``shape, measure, volume`` the functions of their law, None for the
corotational one, which is compiled without a branch for others.
"""

from copy import copy

import numba
import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import Particles
from palpate.effects import principal
from palpate.effects.corotational import BLOCK, hessians, stresses
from palpate.effects.effect import Effect
from palpate.effects.elements import Elements, OnePass, largest_poisson, warn_of_locking
from palpate.effects.principal import PAIRS
from palpate.linalg.block_pattern import BlockPattern


@numba.njit(cache=True, error_model="numpy")
def energy_and_force(x, tetrahedra, gradients, volumes, mu, lam, shape, measure, volume, force):
    """Add nodal forces [N] to ``force`` (n_nodes, 3), and return the energy [J]; shape : None of corotational ones."""
    f, p = np.empty((9, BLOCK)), np.empty((9, BLOCK))
    energies, accepted, total = np.empty(BLOCK), np.empty(BLOCK, dtype=np.bool_), 0.0
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        for k in range(count):
            write_gradient(x, tetrahedra, gradients, begin + k, f, k)
        mus, lams = mu[begin : begin + count], lam[begin : begin + count]
        if shape is None:
            stresses(f, p, count, mus, lams, energies, accepted)
        else:
            principal.stresses(f, p, count, 1, mus, lams, shape, measure, volume, energies)
        for k in range(count):
            e = begin + k
            share = volumes[e]
            total += share * energies[k]
            for i in range(3):
                p0, p1, p2 = share * p[3 * i, k], share * p[3 * i + 1, k], share * p[3 * i + 2, k]
                pull1 = p0 * gradients[e, 1, 0] + p1 * gradients[e, 1, 1] + p2 * gradients[e, 1, 2]
                pull2 = p0 * gradients[e, 2, 0] + p1 * gradients[e, 2, 1] + p2 * gradients[e, 2, 2]
                pull3 = p0 * gradients[e, 3, 0] + p1 * gradients[e, 3, 1] + p2 * gradients[e, 3, 2]
                force[tetrahedra[e, 0], i] += pull1 + pull2 + pull3
                force[tetrahedra[e, 1], i] -= pull1
                force[tetrahedra[e, 2], i] -= pull2
                force[tetrahedra[e, 3], i] -= pull3
    return total


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(x, tetrahedra, gradients, volumes, mu, lam, shape, measure, volume, definite, slots, values):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (4, 4)."""
    f, g, rotated = np.empty((9, BLOCK)), np.empty((9, BLOCK)), np.empty((15, BLOCK))
    shares, blocks, hessian = np.empty(BLOCK), np.empty((54, BLOCK)), np.empty((4, 4, 3, 3))
    pulls, unused = np.empty((9, BLOCK)), np.empty(BLOCK)
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        for k in range(count):
            shares[k] = volumes[begin + k]
            write_gradient(x, tetrahedra, gradients, begin + k, f, k)
            for c in range(3):
                for j in range(3):
                    g[3 * c + j, k] = gradients[begin + k, c + 1, j]
        mus, lams = mu[begin : begin + count], lam[begin : begin + count]
        if shape is None:
            hessians(f, g, shares, count, mus, lams, definite, rotated, blocks)
        else:
            principal.hessians(
                f, g, shares, count, 1, mus, lams, shape, measure, volume, definite, blocks, pulls, unused
            )
        for k in range(count):
            _to_four(blocks, k, hessian)
            for a in range(4):
                for b in range(4):
                    slot = slots[begin + k, a, b]
                    for i in range(3):
                        for j in range(3):
                            values[slot, i, j] += hessian[a, b, i, j]


@numba.njit(cache=True, error_model="numpy")
def write_gradient(x, tetrahedra, gradients, e, f, k):
    """Write F of element ``e`` into column ``k`` of ``f``.

    Trap: from differences of positions, F would be exactly 0 in every element of a body that is collapsed to a point;
    all elements would then choose the same axes, and Newton's method would not leave that state.
    """
    for i in range(3):
        for j in range(3):
            entry = 0.0
            for a in range(4):
                entry += x[tetrahedra[e, a], i] * gradients[e, a, j]
            f[3 * i + j, k] = entry


@numba.njit(cache=True, error_model="numpy")
def _to_four(blocks, k, hessian):
    """Write column ``k`` of ``blocks`` as the ``hessian`` (4, 4, 3, 3) of all four nodes, whose rows add up to zero."""
    for pair in range(6):
        c, d = PAIRS[pair]
        for i in range(3):
            for j in range(3):
                hessian[c + 1, d + 1, i, j] = blocks[9 * pair + 3 * i + j, k]
                hessian[d + 1, c + 1, j, i] = blocks[9 * pair + 3 * i + j, k]
    for i in range(3):
        for j in range(3):
            for a in range(1, 4):
                hessian[a, 0, i, j] = -(hessian[a, 1, i, j] + hessian[a, 2, i, j] + hessian[a, 3, i, j])
                hessian[0, a, j, i] = hessian[a, 0, i, j]
    for i in range(3):
        for j in range(3):
            hessian[0, 0, i, j] = -(hessian[0, 1, i, j] + hessian[0, 2, i, j] + hessian[0, 3, i, j])


def make(particles: Particles, settings: object, elastic: Effect | None = None) -> "LinearElements":
    """Make the elasticity of a solid; warns if it locks."""
    warn_of_locking(particles.name, largest_poisson(particles.tissue))
    return LinearElements(particles, particles.tissue)


class LinearElements(Elements):
    """Elements of Ψ(F) = μ ‖S − I‖² + λ/2 tr²(S − I), F = R S (Müller and Gross 2004; energy: McAdams et al. 2011).

    Small-strain elasticity in the rotated frame of each element. The force is the exact gradient of the energy, as the
    derivative of the rotation cancels. It is finite for collapsed and inverted elements, and restores them. Trap: where
    an inverted element's rotation jumps (s₂ + s₃ = 0), Ψ has a fold, and an equilibrium without a residual may not
    exist. So the fold is smoothed for s₂ + s₃ < FOLD; elsewhere Ψ is unchanged.
    """

    slopes = np.vstack([np.full(3, -1.0), np.eye(3)])[None]

    def __init__(self, mesh: Mesh, tissue: Tissue | Material, pattern: BlockPattern | None = None):
        super().__init__(mesh, mesh.tetrahedra, len(mesh.nodes), tissue, pattern)
        self.tetrahedra = self.couples

    def between(self, nodes: np.ndarray) -> "LinearElements":
        """Return the same elements between other nodes, ``nodes[i]`` in place of node i; nodes : (n,)."""
        other = copy(self)
        OnePass.__init__(other)
        other.tetrahedra = other.couples = nodes[self.tetrahedra]
        return other

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        return energy_and_force(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self.law, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        add_stiffness(
            x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self.law, definite, slots, values
        )


@numba.njit(cache=True)
def deformation_gradient(x, element, gradients, f):
    """Write the deformation gradient of an element into ``f`` (3, 3)."""
    f[:] = 0.0
    for a in range(4):
        node = element[a]
        for i in range(3):
            for j in range(3):
                f[i, j] += x[node, i] * gradients[a, j]
