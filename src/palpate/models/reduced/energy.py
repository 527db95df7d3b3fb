"""A body in few coordinates: its elastic energy, where it comes to rest under forces, and how stiff it is there."""

from typing import NamedTuple

import numpy as np

from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.reduced.cholesky import factor
from palpate.models.reduced.cubature_points import CubaturePoints, add_tangent, least_det
from palpate.models.reduced.search import settle


def softness(surface: np.ndarray) -> np.ndarray:
    """Return the matrix (r, r) that compares the stiffness of a state with that of the body's softest motion at rest.

    It is the mean square of the motion of ``surface`` (n, 3, r), over the largest of motions that have unit energy at
    rest.
    A tangent less a share of it is positive definite where no motion is softer than that share. Trap: the tangent's own
    eigenvalues are small in any bent body, which does not stretch in the same directions as the straight one.
    """
    flat = surface.reshape(-1, surface.shape[2])
    square = flat.T @ flat
    return square / np.linalg.eigvalsh(square)[-1]


ITERATIONS = 200


class Coordinates(NamedTuple):
    """A state in which a reduced model has come to rest.

    q : (r,); residual : of the forces, over the load; least_det : the smallest det F of the cubature points
    """

    q: np.ndarray
    residual: float
    least_det: float


class ReducedEnergy:
    """The energy Σ Ψ(F) V + ½ qᵀ (I − K) q of cubature points, whose stiffness at rest is K, at coordinates q (r,).

    The stiffness of the whole body at rest is the identity in these coordinates: so forces are exact to first order.
    loads : (r, f), unit forces in coordinates, three of each contact
    base : (r, r), the part of the tangent that does not change with q
    """

    def __init__(self, points: CubaturePoints, loads: np.ndarray, law: Law, rest: np.ndarray | None = None):
        self.points, self.loads, self.law = points, np.ascontiguousarray(loads), law
        self._slopes = points.slopes.reshape(-1, points.slopes.shape[2])
        self.rest = np.eye(len(loads)) - points.stiffness if rest is None else rest
        self.body = self.in_blocks(max(len(points.volumes), 1))
        self.base = self.rest
        if law.shape is None:
            weighted = np.tile(2.0 * points.mu * points.volumes, 9)[:, None] * self._slopes
            self.base = self.rest + self._slopes.T @ weighted

    def in_blocks(self, together: int) -> tuple:
        """Return the arguments of ``elastic``, with points in blocks of ``together``; some at the end have no volume.

        They are slopes (b, 9 together, r), volumes and moduli (b, together), ``rest``, and the law's functions.
        """
        slopes, *values = self.points
        if missing := -len(values[0]) % together:
            slopes = np.pad(slopes, ((0, 0), (0, missing), (0, 0)))
            values = [np.pad(each, (0, missing)) for each in values]
        blocks = slopes.reshape(9, -1, together, slopes.shape[2]).transpose(1, 0, 2, 3)
        flat = np.ascontiguousarray(blocks).reshape(len(blocks), 9 * together, -1)
        return flat, *(each.reshape(-1, together) for each in values), self.rest, *self.law

    def settle(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the state under ``force`` (f,) [N]; its residual is above ``tolerance`` where no rest was found."""
        q = np.zeros(len(self.loads))
        left = settle(q, self.loads @ force, self.body, None, tolerance, ITERATIONS)
        return Coordinates(q, left, least_det(q, self._slopes, len(self.points.volumes)))

    def at_rest(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the state at rest under ``force`` (f,) [N]; NotConverged where the residual is above ``tolerance``."""
        settled = self.settle(force, tolerance)
        if not settled.residual <= tolerance:
            raise NotConverged(f"the reduced model stopped at a residual of {settled.residual:.1e}", [settled.residual])
        return settled

    def tangent(self, q: np.ndarray) -> np.ndarray:
        """Return the Hessian (r, r) of the energy at ``q`` (r,): the identity at rest, singular where the body buckles.

        It is NaN where a point of the corotational law is inverted.
        """
        hessian = self.base.copy()
        add_tangent(q, *self.points, *self.law, hessian)
        return hessian

    def is_stiff(self, q: np.ndarray, least: np.ndarray) -> bool:
        """Return whether the tangent at ``q`` (r,) less ``least`` (r, r) is positive definite."""
        return factor(self.tangent(q) - least)
