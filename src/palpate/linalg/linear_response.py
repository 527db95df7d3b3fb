"""Displacements of a linearised body under loads: conjugate gradients, and a check of what they found."""

from collections.abc import Callable

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.conjugate_gradients import conjugate_gradients

MOST = 3000
"""Products after which conjugate gradients give up."""


def linear_response(
    multiply: Callable[[np.ndarray], np.ndarray],
    precondition: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Return displacements (n, 3) [m] under ``right`` (n, 3) [N], or those (n, 3, k) of k loads (n, 3, k) at once.

    multiply, precondition : the stiffness and what approximates its inverse; they take what ``right`` is
    Several loads at once share each reading of the matrix. Raises NotConverged if conjugate gradients do not reach the
    relative residual ``tolerance`` for each of them.
    """
    if not right.any():
        return np.zeros_like(right)
    if right.ndim == 3 and not (loaded := right.any(axis=(0, 1))).all():
        found = np.zeros_like(right)
        found[:, :, loaded] = linear_response(multiply, precondition, right[:, :, loaded], tolerance)
        return found
    found, products, _ = conjugate_gradients(multiply, precondition, right, tolerance, MOST)
    left = float(np.max(np.linalg.norm(right - multiply(found), axis=(0, 1)) / np.linalg.norm(right, axis=(0, 1))))
    if not left <= 10 * tolerance:
        raise NotConverged(
            f"the linear response stopped after {products} products at a relative residual of {left:.1e}, "
            f"above the tolerance {tolerance:.0e}",
            [left],
        )
    return found
