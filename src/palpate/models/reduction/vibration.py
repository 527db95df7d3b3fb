"""Vibration modes: how a held body swings freely about its rest shape, slowest first."""

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from palpate.errors import InputError


def vibrations(
    solve: Callable[[np.ndarray], np.ndarray], masses: np.ndarray, free: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the slowest ``count`` modes (count, n, 3) with φᵀMφ = 1, and their angular frequencies (count,) [1/s].

    solve : applies the inverse of the stiffness at rest to forces (n, 3) [N], held nodes staying where they are
    masses : (n,) [kg]; free : (n,) bool
    They are the largest eigenvectors of M^½ K⁻¹ M^½, so that no matrix is needed. InputError if there are not so many.
    """
    if count >= 3 * free.sum():
        raise InputError(
            f"reduced.vibrations is {count}, and the body has {3 * free.sum()} free coordinates; ask less."
        )
    if not count:
        return np.empty((0, len(masses), 3)), np.empty(0)
    root = np.sqrt(masses * free)[:, None]

    def product(y: np.ndarray) -> np.ndarray:
        return (root * solve(root * y.reshape(-1, 3))).ravel()

    operator = LinearOperator(2 * (root.size * 3,), product, dtype=float)
    start = np.random.default_rng(0).normal(size=root.size * 3)  # fixed, so that the result is reproducible
    squares, vectors = eigsh(operator, count, which="LA", v0=start)
    frequencies = 1.0 / np.sqrt(squares[::-1])
    modes = [w**2 * solve(root * y.reshape(-1, 3)) for w, y in zip(frequencies, vectors.T[::-1], strict=True)]
    return np.array(modes), frequencies
