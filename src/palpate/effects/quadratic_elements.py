"""Corotational elasticity on ten-node tetrahedra with straight sides."""

import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.bodies.refinement import QUADRATURE_POINTS, quadratic_gradients, ten_nodes
from palpate.effects.elements import Elements
from palpate.effects.linear_elements import shape_gradients
from palpate.effects.quadratic_kernel import add_stiffness, energy_and_force, least_det
from palpate.linalg.block_pattern import BlockPattern


class QuadraticElements(Elements):
    """The law of LinearElements at four points of each quadratic element on ``mesh``.

    The unknowns are the positions of the nodes and edge midpoints of ``mesh``, numbered as ``ten_nodes`` says. The
    elements are straight-sided: at rest the midpoints are halfway between the nodes.
    """

    def __init__(self, mesh: Mesh, tissue: Tissue | Material, pattern: BlockPattern | None = None):
        super().__init__(ten_nodes(mesh), len(mesh.nodes) + len(mesh.edges), tissue, pattern)
        self.gradients, self.volumes = shape_gradients(mesh)
        slopes = quadratic_gradients(
            QUADRATURE_POINTS
        )  # of all four coordinates, the first of which is 1 minus the others
        self._slopes = np.ascontiguousarray(slopes[:, :, 1:] - slopes[:, :, :1])

    def resistance(self) -> np.ndarray:
        """Return an upper bound of the stiffness against the motion of a single node, (n_nodes,) [N/m]."""
        squares = np.zeros(self.couples.shape)
        for slopes in self._slopes:
            each = np.einsum("ac,ecj->eaj", slopes, self.gradients[:, 1:])
            squares += np.einsum("eaj,eaj->ea", each, each) * (self.volumes[:, None] / len(self._slopes))
        return self._resistance(squares)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli)
        return energy_and_force(x, *constants, 1, *self._law, force)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F at the elements' points; an element is inverted where it is negative."""
        return float(least_det(x, self.couples, self._slopes, self.gradients))

    def mean_det(self, x: np.ndarray) -> np.ndarray:
        """Return det F of each element, its mean over the four points, (n_elements,)."""
        places, total = x[self.couples], np.zeros(len(self.volumes))
        for slopes in self._slopes:
            f = np.einsum("eai,ac,ecj->eij", places, slopes, self.gradients[:, 1:], optimize=True)
            total += np.linalg.det(f) / len(QUADRATURE_POINTS)
        return total

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], element e's at ``slots[e]`` (10, 10)."""
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli, *self._law)
        add_stiffness(x, *constants, definite, slots, values)
