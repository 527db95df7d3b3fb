"""Corotational elasticity on ten-node tetrahedra with straight sides."""

from functools import cached_property

import numpy as np
from scipy import sparse

from palpate.bodies.body import Material
from palpate.bodies.mesh import Mesh
from palpate.bodies.quadratic import POINTS, shape_slopes, ten_nodes
from palpate.effects.corotational import shape_gradients
from palpate.effects.effect import Energy, Stiffness
from palpate.effects.one_pass import OnePass
from palpate.effects.quadratic_kernel import add_stiffness, energy_and_force
from palpate.linalg.block_pattern import BlockPattern, pattern_of


class QuadraticElements(OnePass, Energy, Stiffness):
    """The law of Corotational at four points of each quadratic element on ``mesh``.

    The unknowns are the positions of the nodes and edge midpoints of ``mesh``, numbered as ``ten_nodes`` says. The
    elements are straight-sided: at rest the midpoints are halfway between the nodes.
    """

    def __init__(self, mesh: Mesh, material: Material, pattern: BlockPattern | None = None):
        super().__init__()
        self.couples = np.ascontiguousarray(ten_nodes(mesh))
        self.gradients, self.volumes = shape_gradients(mesh)
        self.moduli = (material.shear_pa, material.lame_pa)
        slopes = shape_slopes(POINTS)  # of all four coordinates, the first of which is 1 minus the others
        self._slopes = np.ascontiguousarray(slopes[:, :, 1:] - slopes[:, :, :1])
        self._given, self._n_nodes = pattern, len(mesh.nodes) + len(mesh.edges)

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of ``stiffness``."""
        return self._given or pattern_of(self.couples, self._n_nodes)

    def resistance(self) -> np.ndarray:
        """Return an upper bound of the stiffness against the motion of a single node, (n_nodes,) [N/m]."""
        mu, lam = self.moduli
        squares = np.zeros(self.couples.shape)
        for slopes in self._slopes:
            each = np.einsum("ac,ecj->eaj", slopes, self.gradients[:, 1:])
            squares += np.einsum("eaj,eaj->ea", each, each) * (self.volumes[:, None] / len(self._slopes))
        return (2.0 * mu + lam) * np.bincount(self.couples.ravel(), squares.ravel(), minlength=self._n_nodes)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        return energy_and_force(x, self.couples, self._slopes, self.gradients, self.volumes, *self.moduli, force)

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F at the elements' points; an element is inverted where it is negative."""
        places, least = x[self.couples], np.inf
        for slopes in self._slopes:
            f = np.einsum("eai,ac,ecj->eij", places, slopes, self.gradients[:, 1:], optimize=True)
            least = min(least, float(np.linalg.det(f).min()))
        return least

    def stiffness(self, x: np.ndarray, definite: bool = False) -> sparse.bsr_array:
        """Return the Hessian of the energy (3 n_nodes, 3 n_nodes) [N/m] in 3 × 3 blocks.

        ``definite`` clamps negative eigenvalues at each point to zero (Smith, de Goes, Kim 2019, section 5).
        """
        values = np.zeros((len(self.pattern.indices), 3, 3))
        self.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], element e's at ``slots[e]`` (10, 10)."""
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli)
        add_stiffness(x, *constants, definite, slots, values)
