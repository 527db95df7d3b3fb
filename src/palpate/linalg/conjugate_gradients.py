"""Conjugate gradients that detect a matrix that is not positive definite."""

from collections.abc import Callable

import numpy as np


def conjugate_gradients(
    multiply: Callable[[np.ndarray], np.ndarray],
    precondition: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    relative_tolerance: float,
    max_iterations: int,
) -> tuple[np.ndarray, int, bool]:
    """Solve K x = ``right`` (n, 3) from zero; return x, the number of products, and whether all curvature was positive.

    Stops at ‖residual‖ ≤ ``relative_tolerance`` ‖right‖, after ``max_iterations``, or at the first direction along
    which K or the preconditioner has no positive curvature. The x found so far is then a descent direction, unless it
    is zero (Steihaug 1983).
    """
    x = np.zeros_like(right)
    residual = right.copy()
    target = relative_tolerance * np.linalg.norm(right)
    direction, previous = None, 1.0
    for iteration in range(1, max_iterations + 1):
        z = precondition(residual)
        rho = np.vdot(residual, z)
        if not rho > 0.0:
            return x, iteration, False
        direction = z.copy() if direction is None else z + (rho / previous) * direction
        product = multiply(direction)
        curvature = np.vdot(direction, product)
        if not curvature > 0.0:
            return x, iteration, False
        step = rho / curvature
        x += step * direction
        residual -= step * product
        previous = rho
        if np.linalg.norm(residual) <= target:
            break
    return x, iteration, True
