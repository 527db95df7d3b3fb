"""Corotational linear elasticity on tetrahedra: energy, force and exact or definite stiffness."""

import numba
import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect
from palpate.effects.elements import Elements
from palpate.effects.linear_kernel import add_stiffness, energy_and_force
from palpate.effects.locking import largest_poisson, warn_of_locking
from palpate.errors import InputError
from palpate.linalg.block_pattern import BlockPattern


def make(particles: Particles, settings: dict, elastic: Effect | None = None) -> "LinearElements":
    """Make the elasticity of a solid; warns if it locks. InputError if ``particles`` have no tetrahedra."""
    if not len(particles.tetrahedra):
        raise InputError(
            f"{particles.name}: corotational elasticity needs tetrahedra, and these particles have none; "
            "name triangles for a sheet, or springs or shape_matching for a surface."
        )
    warn_of_locking(particles.name, largest_poisson(particles.tissue))
    return LinearElements(particles, particles.tissue)


class LinearElements(Elements):
    """Ψ(F) = μ ‖S − I‖² + λ/2 tr²(S − I) with F = R S (Müller and Gross 2004; energy: McAdams et al. 2011).

    Small-strain elasticity in the rotated frame of each element. The force is the exact gradient of the energy, as the
    derivative of the rotation cancels. It is finite for collapsed and inverted elements, and restores them. Trap: where
    an inverted element's rotation jumps (s₂ + s₃ = 0), Ψ has a fold, and an equilibrium without a residual may not
    exist. So the fold is smoothed for s₂ + s₃ < FOLD; elsewhere Ψ is unchanged.
    """

    def __init__(self, mesh: Mesh, tissue: Tissue | Material, pattern: BlockPattern | None = None):
        super().__init__(mesh.tetrahedra, len(mesh.nodes), tissue, pattern)
        self.tetrahedra = self.couples
        self.gradients, self.volumes = shape_gradients(mesh)

    def resistance(self) -> np.ndarray:
        """Return an upper bound of the stiffness against the motion of a single node, (n_nodes,) [N/m]."""
        return self._resistance(np.einsum("eaj,eaj->ea", self.gradients, self.gradients) * self.volumes[:, None])

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        return energy_and_force(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self._law, force)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F of all elements; an element is inverted where it is negative."""
        f = np.einsum("eai,eaj->eij", x[self.tetrahedra], self.gradients)
        return float(np.linalg.det(f).min())

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], those of element e at ``slots[e]`` (4, 4)."""
        add_stiffness(
            x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self._law, definite, slots, values
        )


def shape_gradients(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Compute gradients of the linear shape functions (n_elements, 4, 3) [1/m] and volumes (n_elements,) [m³]."""
    corners = mesh.nodes[mesh.tetrahedra]
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    normals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    volumes = np.einsum("ei,ei->e", a, normals[:, 0]) / 6.0
    gradients = np.empty((len(corners), 4, 3))
    gradients[:, 1:] = normals / (6.0 * volumes[:, None, None])
    gradients[:, 0] = -gradients[:, 1:].sum(axis=1)
    return gradients, volumes


@numba.njit(cache=True)
def deformation_gradient(x, element, gradients, f):
    """Write the deformation gradient of an element into ``f`` (3, 3)."""
    f[:] = 0.0
    for a in range(4):
        node = element[a]
        for i in range(3):
            for j in range(3):
                f[i, j] += x[node, i] * gradients[a, j]
