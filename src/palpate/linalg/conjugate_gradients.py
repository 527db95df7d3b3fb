"""Conjugate gradients that detect a matrix that is not positive definite, and check what they found."""

from collections.abc import Callable

import numpy as np

from palpate.errors import NotConverged


def conjugate_gradients(
    multiply: Callable[[np.ndarray], np.ndarray],
    precondition: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    relative_tolerance: float,
    max_iterations: int,
) -> tuple[np.ndarray, int, bool]:
    """Solve K x = ``right`` (n, 3) from zero; return x, the number of products, and whether all curvature was positive.

    ``right`` may be k right sides (n, 3, k), none of them zero: each has its own steps, and the last one ends them all.
    Stops at ‖residual‖ ≤ ``relative_tolerance`` ‖right‖, after ``max_iterations``, or at the first direction along
    which K or the preconditioner has no positive curvature. The x found so far is then a descent direction, unless it
    is zero (Steihaug 1983).
    """
    x = np.zeros_like(right)
    residual = right.copy()
    target = relative_tolerance * np.sqrt(_products(right, right))
    direction: np.ndarray | None = None
    previous: np.ndarray | float = 1.0
    for iteration in range(1, max_iterations + 1):
        z = precondition(residual)
        rho = _products(residual, z)
        if not np.all(rho > 0.0):
            return x, iteration, False
        direction = z.copy() if direction is None else z + (rho / previous) * direction
        product = multiply(direction)
        curvature = _products(direction, product)
        if not np.all(curvature > 0.0):
            return x, iteration, False
        step = rho / curvature
        x += step * direction
        residual -= step * product
        previous = rho
        if np.all(np.sqrt(_products(residual, residual)) <= target):
            break
    return x, iteration, True


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar product of ``a`` and ``b`` (n, 3), or those (k,) of each right side of (n, 3, k)."""
    return np.asarray(np.vdot(a, b) if a.ndim == 2 else np.einsum("nik,nik->k", a, b))


MAX_PRODUCTS = 3000
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
    found, products, _ = conjugate_gradients(multiply, precondition, right, tolerance, MAX_PRODUCTS)
    left = float(np.max(np.linalg.norm(right - multiply(found), axis=(0, 1)) / np.linalg.norm(right, axis=(0, 1))))
    if not left <= 10 * tolerance:
        raise NotConverged(
            f"the linear response stopped after {products} products at a relative residual of {left:.1e}, "
            f"above the tolerance {tolerance:.0e}",
            [left],
        )
    return found
