"""Where an explicit step ends that must not lead through anything: the nearest place in the norm of the masses."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from palpate.linalg.block_pattern import gather, hold
from palpate.linalg.factor import Factor
from palpate.solvers.newton import minimise

TOLERANCE = 1e-8
"""Relative residual at which the place counts as found."""
MOST = 40
"""Iterations of Newton's method: a way that ends early at one thing after another had better be cut."""


def project(contact, begin, aim, free, inertia, before) -> np.ndarray:
    """The z (n, 3) [m] of least ½ Σ inertia |z − aim|² + E(z), on a way from ``begin`` that leads through nothing.

    E : the energy of ``contact``; free : (n,) bool, others stay; inertia : (n,) [N/m], mass over squared step;
    before : (n, 3) [N], forces of contact that are likely to act again, as a guess that saves half of the iterations
    Raises NotConverged if it is not found.
    """
    aim = np.where(free[:, None], aim, begin)
    problem = _Nearest(contact, aim, free, inertia)
    ahead = aim - begin
    guess = ahead + np.where(free[:, None], before / inertia[:, None], 0.0)
    starts = [begin, *(begin + contact.limit(begin, way) * way for way in (ahead, guess))]
    begin = min(starts, key=problem.energy)
    scale = float(np.linalg.norm(inertia[:, None] * ahead)) + float(np.linalg.norm(problem.force(begin)))
    return minimise(problem, begin, scale, TOLERANCE, MOST).x if scale > 0.0 else begin


class _Nearest:
    """The minimisation, as Newton's method wants it."""

    def __init__(self, contact, aim: np.ndarray, free: np.ndarray, inertia: np.ndarray):
        self._contact, self._aim, self._free, self._inertia = contact, aim, free, inertia[:, None]

    def energy(self, z: np.ndarray) -> float:
        away = z - self._aim
        return 0.5 * float(np.vdot(self._inertia * away, away)) + self._contact.energy(z)

    def force(self, z: np.ndarray) -> np.ndarray:
        force = -self._inertia * (z - self._aim)
        self._contact.add_force(z, np.zeros_like(z), force)
        return np.where(self._free[:, None], force, 0.0)

    def limit(self, z: np.ndarray, direction: np.ndarray) -> float:
        return self._contact.limit(z, direction)

    def linearise(self, z: np.ndarray, definite: bool) -> tuple[Callable, Callable]:
        matrix = self._matrix(z, definite)
        return lambda p: (matrix @ p.ravel()).reshape(p.shape), Factor(matrix).solve

    def _matrix(self, z: np.ndarray, definite: bool) -> sparse.bsr_array:
        alone = np.arange(len(z))
        masses = alone, alone, self._inertia[:, :, None] * np.eye(3)
        matrix = gather([masses, self._contact.touching(z, definite)], len(z))
        hold(matrix.indptr, matrix.indices, matrix.data, ~self._free)
        return matrix
