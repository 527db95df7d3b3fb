"""Relax a body with one constant matrix: projective dynamics to the equilibrium of corotational linear elements.

After Bouaziz and others (2014), seen as Liu, Bouaziz and Kavan (2017) do: projecting each element on its rotation and
solving with the constant matrix Σ (2μ + λ) V G Gᵀ, which is the same for x, y and z, is a descent along that matrix'
inverse times the force. With a memory of the last steps it is theirs, L-BFGS; without, it is the original. The
stiffness of a bed is constant, and the same for x, y and z, too: it is added to the matrix. A node that an instrument
overlaps is projected on the instrument's surface, along the normal, with a weight of its own.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from palpate.effects.bed import BedSprings
from palpate.effects.linear_elements import LinearElements
from palpate.effects.node_contact import NodeContact
from palpate.solvers.lbfgs import minimise_by_lbfgs
from palpate.solvers.pressed_descent import PressedDescent

TOLERANCE = 1e-10
"""Of the residual, relative to the load."""


class ProjectiveDynamics:
    """Descent from one projection of ``elements`` to the next, on a ``bed`` or None; ``held`` (n,) bool."""

    def __init__(self, elements: LinearElements, held: np.ndarray, bed: BedSprings | None = None):
        self._effects: list[LinearElements | BedSprings] = [elements] if bed is None else [elements, bed]
        self._held = held
        mu, lam = elements.moduli
        weights = (2.0 * mu + lam) * elements.volumes
        blocks = np.einsum("e,eai,ebi->eab", weights, elements.gradients, elements.gradients)
        couples, count = elements.tetrahedra, len(held)
        rows, columns = np.repeat(couples, 4, axis=1).ravel(), np.tile(couples, 4).ravel()
        matrix = sparse.csc_array((blocks.ravel(), (rows, columns)), shape=(count, count))
        matrix = matrix if bed is None else (matrix + bed.scalar).tocsc()
        self._free = np.flatnonzero(~held)
        self._lu = splu(matrix[self._free][:, self._free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        self._load = np.zeros((count, 3))

    def relax(
        self, x: np.ndarray, load: np.ndarray, iterations: int, memory: int, before: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return positions after so many iterations from ``x`` (n, 3) [m] under ``load`` (n, 3) [N], and ``x``.

        memory : how many steps the matrix is improved by; 0 for the original
        before : what the others go on with; the memory begins anew
        """
        self._load, self._rest = np.where(self._held[:, None], 0.0, load), x
        tolerance_n = TOLERANCE * float(np.linalg.norm(self._load))
        return minimise_by_lbfgs(self, self._solve, x, tolerance_n, iterations, kept=memory).x, x

    def pressed(self, contact: NodeContact) -> PressedDescent:
        """Return what relaxes the body under an instrument; the stiffness of ``contact`` is the weight of its nodes."""
        return PressedDescent(self._effects, contact, self._held, self._solve, isotropic=True)

    def energy(self, x: np.ndarray) -> float:
        return sum(each.energy(x) for each in self._effects) - float(np.vdot(self._load, x - self._rest))

    def force(self, x: np.ndarray) -> np.ndarray:
        force = self._load.copy()
        for each in self._effects:
            each.add_force(x, None, force)
        force[self._held] = 0.0
        return force

    def _solve(self, right: np.ndarray) -> np.ndarray:
        step = np.zeros_like(right)
        step[self._free] = self._lu.solve(right[self._free])
        return step
