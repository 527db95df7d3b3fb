"""A body at rest in few coordinates: its energy, where it settles under forces, and how stiff it is there."""

from typing import NamedTuple

import numpy as np

from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.reduced.cells import Cells, add_tangent, least_det
from palpate.models.reduced.cholesky import factor
from palpate.models.reduced.search import settle


def softness(surface: np.ndarray) -> np.ndarray:
    """Return (r, r), the mean square motion of the ``surface`` (n, 3, r) over the largest that has unit energy at rest.

    A tangent less a share of it is positive definite where nothing has become softer than that share of what the body's
    softest motion is at rest. Trap: the tangent's own eigenvalues are small in any bent body, which does not stretch
    in the same directions as the straight one.
    """
    flat = surface.reshape(-1, surface.shape[2])
    square = flat.T @ flat
    return square / np.linalg.eigvalsh(square)[-1]


ITERATIONS = 200


class Coordinates(NamedTuple):
    """Coordinates at which a reduced model has come to rest.

    q : (r,); residual : what is left, over the load; least_det : the smallest det F of its cells
    """

    q: np.ndarray
    residual: float
    least_det: float


class ReducedEnergy:
    """The energy Σ Ψ(F) V + ½ qᵀ (I − K) q over cells, K being their stiffness at rest: exact to first order.

    The coordinates q (r,) are those of a basis in which the stiffness at rest is the identity.
    loads : (r, f), the unit forces in these coordinates, three of each contact
    base : (r, r), what of the tangent does not change
    """

    def __init__(self, cells: Cells, loads: np.ndarray, law: Law, rest: np.ndarray | None = None):
        self.cells, self.loads, self.law = cells, np.ascontiguousarray(loads), law
        self._slopes = cells.slopes.reshape(-1, cells.slopes.shape[2])
        self.rest = np.eye(len(loads)) - cells.stiffness if rest is None else rest
        self.body = self.in_blocks(max(len(cells.volumes), 1))
        self.base = self.rest
        if law.shape is None:
            weighted = np.tile(2.0 * cells.mu * cells.volumes, 9)[:, None] * self._slopes
            self.base = self.rest + self._slopes.T @ weighted

    def in_blocks(self, together: int) -> tuple:
        """Return what ``elastic`` takes, cells in blocks of so many; some at the end have no volume.

        These are slopes (b, 9 together, r), volumes and moduli (b, together), ``rest``, and the law's functions.
        """
        slopes, *values = self.cells
        if missing := -len(values[0]) % together:
            slopes = np.pad(slopes, ((0, 0), (0, missing), (0, 0)))
            values = [np.pad(each, (0, missing)) for each in values]
        blocks = slopes.reshape(9, -1, together, slopes.shape[2]).transpose(1, 0, 2, 3)
        flat = np.ascontiguousarray(blocks).reshape(len(blocks), 9 * together, -1)
        return flat, *(each.reshape(-1, together) for each in values), self.rest, *self.law

    def settle(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N], whose residual is above ``tolerance`` if none were found."""
        q = np.zeros(len(self.loads))
        left = settle(q, self.loads @ force, self.body, None, tolerance, ITERATIONS)
        return Coordinates(q, left, least_det(q, self._slopes, len(self.cells.volumes)))

    def at_rest(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N]; NotConverged if none have so small a residual."""
        found = self.settle(force, tolerance)
        if not found.residual <= tolerance:
            raise NotConverged(f"the reduced model stopped at a residual of {found.residual:.1e}", [found.residual])
        return found

    def tangent(self, q: np.ndarray) -> np.ndarray:
        """Return the Hessian (r, r) of the energy at ``q`` (r,): the identity at rest, singular where it gives way.

        It is NaN where a cell of the corotational law is inverted.
        """
        found = self.base.copy()
        add_tangent(q, *self.cells, *self.law, found)
        return found

    def is_stiff(self, q: np.ndarray, least: np.ndarray) -> bool:
        """Return whether the tangent at ``q`` (r,) less ``least`` (r, r) is positive definite."""
        return factor(self.tangent(q) - least)
