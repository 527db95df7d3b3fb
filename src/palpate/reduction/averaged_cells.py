"""Elastic energy of a body that moves in modes, from the mean deformation of its cells."""

import numba
import numpy as np
from scipy import sparse

from palpate.effects import principal
from palpate.effects.corotational_stress import BLOCK, stresses
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError


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
        self._means = means.reshape(9 * count, r)
        mu, lam = elastic.moduli
        self._moduli = _mean(mu, elastic.volumes, together), _mean(lam, elastic.volumes, together)
        self._law = elastic.law
        self.modulus = modes.T @ (stiffness @ modes) - self._at_rest()

    def _at_rest(self) -> np.ndarray:
        """Return the stiffness (r, r) of the cells at rest: that of linear elasticity."""
        h = self._means.reshape(3, 3, len(self.volumes), -1)
        strain = 0.5 * (h + h.transpose(1, 0, 2, 3))
        swelling = strain[0, 0] + strain[1, 1] + strain[2, 2]
        mu, lam = (m * self.volumes for m in self._moduli)
        shape = np.tensordot(strain * (2.0 * mu)[:, None], strain, axes=((0, 1, 2), (0, 1, 2)))
        return (swelling * lam[:, None]).T @ swelling + shape

    def evaluate(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy [J] at ``q`` (r,) and its gradient (r,)."""
        f = (self._means @ q).reshape(9, -1)
        f[[0, 4, 8]] += 1.0
        energy = _stresses(f, self.volumes, *self._moduli, *self._law)
        rest = self.modulus @ q
        return energy + 0.5 * float(q @ rest), f.ravel() @ self._means + rest

    def least_det(self, q: np.ndarray) -> float:
        """Return the smallest det F of all cells at ``q`` (r,)."""
        f = (self._means @ q).reshape(3, 3, -1).transpose(2, 0, 1) + np.eye(3)
        return float(np.linalg.det(f).min())


def _mean(moduli: np.ndarray, volumes: np.ndarray, together: int) -> np.ndarray:
    """Return the means (n_cells,) of ``moduli`` (n_elements,), by volume."""
    sums = (np.broadcast_to(moduli, volumes.shape) * volumes).reshape(-1, together).sum(axis=1)
    return sums / volumes.reshape(-1, together).sum(axis=1)


@numba.njit(cache=True, error_model="numpy")
def _stresses(f, volumes, mu, lam, shape, measure, volume):
    """Replace ``f`` (9, n_cells) by the stresses P times the volumes [J], and return the energy [J]."""
    given, p = np.empty((9, BLOCK)), np.empty((9, BLOCK))
    energies, sure, total = np.empty(BLOCK), np.empty(BLOCK, dtype=np.bool_), 0.0
    for begin in range(0, len(volumes), BLOCK):
        count = min(BLOCK, len(volumes) - begin)
        for i in range(9):
            for k in range(count):
                given[i, k] = f[i, begin + k]
        mus, lams = mu[begin : begin + count], lam[begin : begin + count]
        if shape is None:
            stresses(given, p, count, mus, lams, energies, sure)
        else:
            principal.stresses(given, p, count, 1, mus, lams, shape, measure, volume, energies)
        for k in range(count):
            total += volumes[begin + k] * energies[k]
            for i in range(9):
                f[i, begin + k] = volumes[begin + k] * p[i, k]
    return total
