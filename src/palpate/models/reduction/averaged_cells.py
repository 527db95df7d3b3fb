"""Elastic energy of a body that moves in modes, from the mean deformation of its cells."""

import numpy as np
from scipy import sparse

from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.models.reduction.cells import Cells
from palpate.models.reduction.settle import cell_stresses


class AveragedCells:
    """E(q) = Σ V Ψ(F) + ½ qᵀ(ΦᵀKΦ − K_cells) q, F being the mean deformation gradient of a cell at X + Φ q.

    A cell is the ``8**coarsened`` elements, one after another, of the element ``coarsened`` levels up.
    The second term puts right what averaging loses for small motions: the stiffness K at rest is exact.

    r modes, ``modulus`` (r, r) [J] is that term's matrix
    """

    def __init__(self, elastic: LinearElements, modes: np.ndarray, stiffness: sparse.sparray, coarsened: int):
        """Average ``modes`` (3n, r) over cells; InputError if the elements are not those of split ones."""
        together = 8**coarsened
        if len(elastic.tetrahedra) % together:
            raise InputError(
                f"reduced.coarsened is {coarsened}, and {len(elastic.tetrahedra)} elements are no multiple of "
                f"{together}; give at most the level of the scene."
            )
        self.volumes = elastic.volumes.reshape(-1, together).sum(axis=1)
        shares = elastic.volumes.reshape(-1, together, 1, 1) / self.volumes[:, None, None, None]
        count, r = len(self.volumes), modes.shape[1]
        means = np.empty((9, count, r))
        for k, mode in enumerate(modes.T):
            of_elements = np.einsum("eai,eaj->eij", mode.reshape(-1, 3)[elastic.tetrahedra], elastic.gradients)
            mean = (shares * of_elements.reshape(count, together, 3, 3)).sum(axis=1)
            means[:, :, k] = mean.reshape(count, 9).T
        moduli = [_mean(m, elastic.volumes, together) for m in elastic.moduli]
        cells = Cells(means, self.volumes, *moduli)
        self._means, self._law = means.reshape(9 * count, r), elastic.law
        self._moduli, self._stresses = moduli, np.empty((9, count))
        self._scratch = np.empty((9, count)), np.empty(count), np.empty(count, dtype=bool)
        self.modulus = modes.T @ (stiffness @ modes) - cells.stiffness

    def evaluate(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy [J] at ``q`` (r,) and its gradient (r,)."""
        f, energies, sure = self._scratch
        mu, lam = self._moduli
        energy = cell_stresses(q, self._means, self.volumes, mu, lam, *self._law, f, self._stresses, energies, sure)
        rest = self.modulus @ q
        return energy + 0.5 * float(q @ rest), self._stresses.ravel() @ self._means + rest

    def least_det(self, q: np.ndarray) -> float:
        """Return the smallest det F of all cells at ``q`` (r,)."""
        f = (self._means @ q).reshape(3, 3, -1).transpose(2, 0, 1) + np.eye(3)
        return float(np.linalg.det(f).min())


def _mean(moduli: np.ndarray, volumes: np.ndarray, together: int) -> np.ndarray:
    """Return the means (n_cells,) of ``moduli`` (n_elements,), by volume."""
    sums = (np.broadcast_to(moduli, volumes.shape) * volumes).reshape(-1, together).sum(axis=1)
    return sums / volumes.reshape(-1, together).sum(axis=1)
