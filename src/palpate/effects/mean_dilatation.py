"""Quadratic elements that do not lock: their volume is resisted on average (mean dilatation, P2 / P0)."""

import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.effects import mean_dilatation_kernel
from palpate.effects.law import law_of
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.effects.quadratic_kernel import POINTS, energy_and_force
from palpate.linalg.block_pattern import BlockPattern


class MeanDilatation(QuadraticElements):
    """Ψ = W(s) at four points and V U(mean θ) for each element (Nagtegaal, Parks, Rice 1974).

    As the mean of θ is one number, an element of ten nodes keeps enough freedom when ν tends to 1/2; plain elements,
    which resist at four points, lock. In the linear case it is the mixed element of quadratic displacements and a
    constant pressure (Malkus and Hughes 1978).
    """

    def __init__(self, mesh: Mesh, tissue: Tissue | Material, pattern: BlockPattern | None = None):
        super().__init__(mesh, tissue, pattern)
        self._law = law_of(self.tissue.law)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli)
        return energy_and_force(x, *constants, POINTS, *self._law, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], element e's at ``slots[e]`` (10, 10)."""
        self.add_soft_stiffness(x, definite, np.full(len(self.volumes), np.inf), slots, values)

    def add_soft_stiffness(
        self, x: np.ndarray, definite: bool, most: np.ndarray, slots: np.ndarray, values: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Add the Hessian with U″ of at most ``most`` (n_elements,) [Pa], and return what is left out.

        That is Σ wₑ rₑ rₑᵀ with the rows r (n_elements, 10, 3) [m²] and weights w (n_elements,) [Pa/m³] returned.
        """
        rows, weights = np.empty((*self.couples.shape, 3)), np.empty(len(self.volumes))
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli, *self._law)
        mean_dilatation_kernel.add_stiffness(x, *constants, definite, most, slots, values, rows, weights)
        return rows, weights
