"""A reduced model of one contact: a basis, cells, and what their energy lacks at rest."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.reduction.cells import Cells
from palpate.models.reduction.settle import cell_stresses, pulled_by_each, settle
from palpate.models.reduction.thinning import few_of

ITERATIONS = 200


class Coordinates(NamedTuple):
    """Coordinates at which a reduced model has come to rest.

    q : (r,); residual : what is left, over the load; least_det : the smallest det F of its cells
    """

    q: np.ndarray
    residual: float
    least_det: float


class ReducedContact:
    """The energy Σ Ψ(F) V + ½ qᵀ (I − K) q over cells, K being their stiffness at rest: exact to first order.

    The coordinates q (r,) are those of a basis in which the stiffness at rest is the identity.
    loads : (r, f), the unit forces in these coordinates, three of each contact
    """

    def __init__(self, cells: Cells, loads: np.ndarray, law: Law, rest: np.ndarray | None = None):
        self.cells, self.loads, self.law = cells, np.ascontiguousarray(loads), law
        self._slopes = cells.slopes.reshape(-1, cells.slopes.shape[2])
        self.rest = np.eye(len(loads)) - cells.stiffness if rest is None else rest

    def settle(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N], whose residual is above ``tolerance`` if none were found."""
        q, load = np.zeros(len(self.loads)), self.loads @ force
        cells = (self._slopes, self.cells.volumes, self.cells.mu, self.cells.lam, self.rest)
        left, least, _ = settle(load, *cells, *self.law, tolerance, ITERATIONS, q)
        return Coordinates(q, left, least)

    def at_rest(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N]; NotConverged if none have so small a residual."""
        found = self.settle(force, tolerance)
        if not found.residual <= tolerance:
            raise NotConverged(f"the reduced model stopped at a residual of {found.residual:.1e}", [found.residual])
        return found

    def thinned(
        self, answers: Sequence[np.ndarray], tolerance: float, wanted: Sequence[np.ndarray] | None = None
    ) -> "ReducedContact":
        """Return a model of few cells, which pull as all do at the ``answers`` [(r,)], to the relative ``tolerance``.

        Only what is not linear is fitted, each answer by itself over its size; the linear part is exact in any case.
        wanted : by what all pull beyond their linear part, [(r,)], if the cells are not all there are
        """
        pulls = self._pulls(np.array(answers))
        sums = pulls.sum(axis=0) if wanted is None else np.array(wanted)
        sizes = np.linalg.norm(sums, axis=1)
        pulls /= sizes[:, None]
        rows, target = pulls.reshape(len(pulls), -1).T, (sums / sizes[:, None]).ravel()
        chosen, weights = few_of(rows, target, tolerance)
        return ReducedContact(self.cells.take(chosen, weights), self.loads, self.law)

    def _pulls(self, answers: np.ndarray) -> np.ndarray:
        """Return what each cell adds to the gradient beyond its linear part at ``answers`` (s, r): (k, s, r)."""
        slopes, volumes, mu, lam = self.cells
        count = len(volumes)
        f, p, energies, sure = np.empty((9, count)), np.empty((9, count)), np.empty(count), np.empty(count, dtype=bool)
        found = np.empty((count, *answers.shape))
        for s, q in enumerate(answers):
            cell_stresses(q, self._slopes, volumes, mu, lam, *self.law, f, p, energies, sure)
            moved = f.reshape(3, 3, count) - np.eye(3)[:, :, None]
            strain = 0.5 * (moved + moved.transpose(1, 0, 2)).reshape(9, count)
            linear = 2.0 * mu * strain
            linear[[0, 4, 8]] += lam * (strain[0] + strain[4] + strain[8])
            pulled_by_each(p - linear * volumes, slopes, found[:, s])
        return found
