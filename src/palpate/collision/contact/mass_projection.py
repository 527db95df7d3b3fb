"""End of an explicit step that must not pass through anything: the nearest place in the norm of the masses."""

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from palpate.linalg.block_pattern import gather, hold
from palpate.linalg.factor import Factor
from palpate.solvers.newton import Product, minimise

if TYPE_CHECKING:
    from palpate.collision.contact.barrier_contact import Contact

TOLERANCE = 1e-8
"""Relative residual at which the place counts as found."""
MAX_ITERATIONS = 40
"""Iterations of Newton's method: a path that is stopped by one obstacle after another is better halved."""


def project(
    contact: "Contact",
    start: np.ndarray,
    target: np.ndarray,
    free: np.ndarray,
    inertia: np.ndarray,
    last_forces: np.ndarray,
) -> np.ndarray:
    """Find the z (n, 3) [m] of least ½ Σ inertia |z − target|² + E(z), on an intersection-free path from ``start``.

    E : the energy of ``contact``; free : (n,) bool, others stay; inertia : (n,) [N/m], mass over squared step;
    last_forces : (n, 3) [N], forces of contact that are likely to act again, a guess that saves half of the iterations
    Raises NotConverged if it is not found.
    """
    target = np.where(free[:, None], target, start)
    problem = _Problem(contact, target, free, inertia)
    displacement = target - start
    guess = displacement + np.where(free[:, None], last_forces / inertia[:, None], 0.0)
    starts = [start, *(start + contact.limit(start, motion) * motion for motion in (displacement, guess))]
    start = min(starts, key=problem.energy)
    scale = float(np.linalg.norm(inertia[:, None] * displacement)) + float(np.linalg.norm(problem.force(start)))
    return minimise(problem, start, scale, TOLERANCE, MAX_ITERATIONS).x if scale > 0.0 else start


class _Problem:
    """The minimisation, in the form that Newton's method needs."""

    def __init__(self, contact: "Contact", target: np.ndarray, free: np.ndarray, inertia: np.ndarray):
        self._contact, self._target, self._free, self._inertia = contact, target, free, inertia[:, None]

    def energy(self, z: np.ndarray) -> float:
        away = z - self._target
        return 0.5 * float(np.vdot(self._inertia * away, away)) + self._contact.energy(z)

    def force(self, z: np.ndarray) -> np.ndarray:
        force = -self._inertia * (z - self._target)
        self._contact.add_force(z, np.zeros_like(z), force)
        return np.where(self._free[:, None], force, 0.0)

    def limit(self, z: np.ndarray, direction: np.ndarray) -> float:
        return self._contact.limit(z, direction)

    def linearise(self, z: np.ndarray, definite: bool) -> tuple[Product, Product]:
        matrix = self._matrix(z, definite)
        return lambda p: (matrix @ p.ravel()).reshape(p.shape), Factor(matrix).solve

    def _matrix(self, z: np.ndarray, definite: bool) -> sparse.bsr_array:
        alone = np.arange(len(z))
        masses = alone, alone, self._inertia[:, :, None] * np.eye(3)
        matrix = gather([masses, self._contact.touching(z, definite)], len(z))
        hold(matrix.indptr, matrix.indices, matrix.data, ~self._free)
        return matrix
