"""Parts that linear and quadratic elements share: their tissue, and a stiffness matrix from the blocks they add."""

from functools import cached_property

import numpy as np
from scipy import sparse

from palpate.bodies.material import LAWS, Material, Tissue, uniform
from palpate.effects.effect import Energy, Stiffness
from palpate.effects.law import INVERTED, PLAIN, Law, evaluate, law_of
from palpate.effects.one_pass import OnePass
from palpate.linalg.block_pattern import BlockPattern, pattern_of


class Elements(OnePass, Energy, Stiffness):
    """Elastic elements between ``n_nodes`` nodes.

    couples : (n_elements, k) their nodes; moduli : Lamé's constants μ and λ of each at rest, two (n_elements,) [Pa]
    """

    def __init__(self, couples: np.ndarray, n_nodes: int, tissue: Tissue | Material, pattern: BlockPattern | None):
        super().__init__()
        self.couples, self._n_nodes, self._given = np.ascontiguousarray(couples), n_nodes, pattern
        self.tissue = uniform(tissue, len(couples)) if isinstance(tissue, Material) else tissue
        self.moduli = (self.tissue.shear_pa, self.tissue.lame_pa)
        self._law = PLAIN if self.tissue.law == LAWS[0] else law_of(self.tissue.law)
        self.forbids = self._law.shape is not None and evaluate(self._law, INVERTED, 1.0, 1.0)[0] == np.inf

    @property
    def law(self) -> Law:
        """The compiled functions of the elements' law."""
        return self._law

    @cached_property
    def pattern(self) -> BlockPattern:
        """The pattern of ``stiffness``."""
        return self._given or pattern_of(self.couples, self._n_nodes)

    def stiffness(self, x: np.ndarray, definite: bool = False) -> sparse.bsr_array:
        """Return the Hessian of the energy (3 n_nodes, 3 n_nodes) [N/m] in 3 × 3 blocks.

        ``definite`` clamps negative eigenvalues at each point to zero (Smith, de Goes, Kim 2019, section 5).
        """
        values = np.zeros((len(self.pattern.indices), 3, 3))
        self.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def resistance(self) -> np.ndarray:
        """Return an upper bound of the stiffness against the motion of a single node, (n_nodes,) [N/m]."""
        raise NotImplementedError

    def least_det(self, x: np.ndarray) -> float:
        """Return the smallest det F at the elements' points; an element is inverted where it is negative."""
        raise NotImplementedError

    def _resistance(self, squares: np.ndarray) -> np.ndarray:
        """Sum (2μ + λ) times ``squares`` (n_elements, k), ∫ |∇N|² [m], at the nodes."""
        mu, lam = self.moduli
        weights = (2.0 * mu + lam)[:, None] * squares
        return np.bincount(self.couples.ravel(), weights.ravel(), minlength=self._n_nodes)
