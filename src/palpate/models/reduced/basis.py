"""Modes of reduced models: what they are made of, and how they become independent, with the stiffness the identity."""

from collections.abc import Callable
from itertools import combinations_with_replacement, product

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from palpate.errors import InputError
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest

Solve = Callable[[np.ndarray], np.ndarray]
"""The inverse of the stiffness at rest: forces (n, 3) [N] to displacements (n, 3) [m], zero at held nodes."""
DEPENDENT = 1e-9
"""Columns count as dependent below this eigenvalue of their products, in parts of its largest."""
BEND_STEP = 0.01
"""Largest displacement of an answer at which its bend is measured, in sizes of the body."""


def products(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the products (r, s) of columns (n, 3, r) with other columns (n, 3, s)."""
    flat = first.reshape(-1, first.shape[2])
    return flat.T @ second.reshape(len(flat), -1)


def independent(square: np.ndarray, sizes: np.ndarray | None = None, least: float = DEPENDENT) -> np.ndarray:
    """Return weights (k, r) of k columns whose r sums are orthonormal; ``square`` (k, k) : the columns' products.

    sizes : (k,) by which columns are divided first; None: their own norms
    least : eigenvalues of the scaled products below this part of the largest are left out as dependent
    The last combinations hold most of the columns (method of snapshots, Sirovich 1987).
    """
    sizes = np.sqrt(square.diagonal()) if sizes is None else sizes
    inverse_sizes = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
    values, turns = np.linalg.eigh(inverse_sizes[:, None] * square * inverse_sizes)
    kept = values > least * values[-1]
    return inverse_sizes[:, None] * turns[:, kept] / np.sqrt(values[kept])


def orthonormal(elements: ElementsAtRest, columns: np.ndarray) -> np.ndarray:
    """Return a basis (n, 3, r) of ``columns`` (n, 3, k) in which the stiffness at rest is the identity; r ≤ k.

    Columns are scaled to equal energy before their products are computed, which keeps more digits of dependent ones.
    """
    flat = columns.reshape(-1, columns.shape[2])
    stiff = elements.multiply(np.ascontiguousarray(columns)).reshape(flat.shape)
    sizes = np.sqrt(np.einsum("ik,ik->k", flat, stiff))
    flat, stiff = (each[:, sizes > 0.0] / sizes[sizes > 0.0] for each in (flat, stiff))
    return (flat @ independent(flat.T @ stiff, np.ones(flat.shape[1]))).reshape(*columns.shape[:2], -1)


def coordinates(elements: ElementsAtRest, answers: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Return the coordinates (r, s) of displacements ``answers`` (n, 3, s) [m] in orthonormal ``modes`` (n, 3, r)."""
    return np.tensordot(modes, elements.multiply(np.ascontiguousarray(answers)), ((0, 1), (0, 1)))


def bending_loads(elements: ElementsAtRest, columns: np.ndarray, others: np.ndarray | None = None) -> np.ndarray:
    """Return second derivatives (n, 3, m) [N] of the elastic force f along pairs a, b of ``columns`` (n, 3, k).

    Without ``others`` these are all k (k + 1) / 2 pairs of columns, each with itself too; with ``others`` (n, 3, j),
    the k j pairs of a column and another.
    Linear responses to them are the columns' static derivatives (Idelsohn and Cardona 1985; Barbič and James 2005,
    section 4). Columns are scaled to a peak of BEND_STEP body sizes, and derivatives are central differences.
    """

    def scaled(given: np.ndarray) -> list[np.ndarray]:
        small = BEND_STEP * elements.size * (given / np.linalg.norm(given, axis=1).max(axis=0))
        return [np.ascontiguousarray(each) for each in small.transpose(2, 0, 1)]

    def bent(u: np.ndarray) -> np.ndarray:
        return elements.force(u) + elements.force(-u)  # f″(u, u) to second order

    u_a = scaled(columns)
    u_b = u_a if others is None else scaled(others)
    bend_a = [bent(u) for u in u_a]
    bend_b = bend_a if others is None else [bent(u) for u in u_b]
    numbers = range(len(u_a)), range(len(u_b))
    pairs = combinations_with_replacement(numbers[0], 2) if others is None else product(*numbers)
    loads = [
        bend_a[a] if others is None and a == b else 0.5 * (bent(u_a[a] + u_b[b]) - bend_a[a] - bend_b[b])
        for a, b in pairs
    ]
    return np.stack(loads, axis=2)


def vibrations(solve: Solve, masses: np.ndarray, free: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute the ``count`` slowest vibrations: modes (count, n, 3) with φᵀMφ = 1, and frequencies (count,) [rad/s].

    solve : the inverse of the stiffness at rest, from forces (n, 3) [N] to displacements, zero at held nodes
    masses : (n,) [kg]; free : (n,) bool
    The modes are the largest eigenvectors of M^½ K⁻¹ M^½, which needs no matrix. InputError for a body with fewer
    modes.
    """
    if count >= 3 * free.sum():
        raise InputError(f"vibrations is {count}, and the body has {3 * free.sum()} free coordinates; ask less.")
    if not count:
        return np.empty((0, len(masses), 3)), np.empty(0)
    root = np.sqrt(masses * free)[:, None]

    def applied(y: np.ndarray) -> np.ndarray:
        return (root * solve(root * y.reshape(-1, 3))).ravel()

    operator = LinearOperator(2 * (root.size * 3,), applied, dtype=float)
    start = np.random.default_rng(0).normal(size=root.size * 3)  # fixed, so that the result is reproducible
    squares, vectors = eigsh(operator, count, which="LA", v0=start)
    frequencies = 1.0 / np.sqrt(squares[::-1])
    modes = [w**2 * solve(root * y.reshape(-1, 3)) for w, y in zip(frequencies, vectors.T[::-1], strict=True)]
    return np.array(modes), frequencies
