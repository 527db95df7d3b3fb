"""Cholesky's method for the small dense matrices of reduced models, compiled, so that kernels can call it."""

import numba

ARITHMETIC = {"reassoc", "contract", "nsz"}
"""Sums in any order, so that rows are multiplied side by side; a matrix that is not finite is still told."""


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def factor(matrix):
    """Factor the symmetric ``matrix`` (r, r) in place; return whether it is positive definite, which NaN is not.

    Its lower triangle becomes L with L Lᵀ = matrix, and the diagonal the inverse of L's.
    """
    for i in range(len(matrix)):
        for j in range(i):
            subtracted = 0.0
            for k in range(j):
                subtracted += matrix[i, k] * matrix[j, k]
            matrix[i, j] = (matrix[i, j] - subtracted) * matrix[j, j]
        subtracted = 0.0
        for k in range(i):
            subtracted += matrix[i, k] * matrix[i, k]
        pivot = matrix[i, i] - subtracted
        if not pivot > 0.0:
            return False
        matrix[i, i] = 1.0 / pivot**0.5
    return True


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def solve(factored, b):
    """Write the solution with a matrix that ``factor`` has ``factored`` (r, r) into ``b`` (r,)."""
    for i in range(len(b)):
        subtracted = 0.0
        for j in range(i):
            subtracted += factored[i, j] * b[j]
        b[i] = (b[i] - subtracted) * factored[i, i]
    for i in range(len(b) - 1, -1, -1):
        b[i] *= factored[i, i]
        for j in range(i):
            b[j] -= b[i] * factored[i, j]
