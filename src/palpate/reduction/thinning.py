"""Choose few cells, with weights that are not negative, that pull as all of them do."""

import numpy as np

STILL = 1e-6
"""Columns smaller than this part of the largest are not taken: rounding would choose them, with huge weights."""


def few_of(pulls: np.ndarray, target: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers (k,) and weights (k,) > 0 of columns whose weighted sum is ``target``, to ``tolerance``.

    pulls : (rows, n), what each of n cells pulls by under the training loads; target : (rows,), what all pull by; the
        tolerance is relative
    Non-negative least squares that ends early (Lawson and Hanson 1974, chapter 23; Farhat, Chapman and Avery 2015,
    algorithm 1): columns are taken one by one, the one most like the remainder first, so that few are left.
    """
    size = np.linalg.norm(pulls, axis=0)
    size = np.where(size > STILL * size.max(), size, np.inf)
    rough = pulls.astype(np.float32)  # enough to choose by, and half as long
    chosen: list[int] = []
    weights, left = np.empty(0), target
    while np.linalg.norm(left) > tolerance * np.linalg.norm(target) and len(chosen) < min(pulls.shape):
        likeness = (left.astype(np.float32) @ rough) / size
        likeness[chosen] = -np.inf
        best = int(np.argmax(likeness))
        if not likeness[best] > 0.0:
            break
        chosen, weights = _positive(pulls, target, [*chosen, best], np.append(weights, 0.0))
        left = target - pulls[:, chosen] @ weights
    return np.array(chosen, dtype=int), weights


def _positive(
    pulls: np.ndarray, target: np.ndarray, chosen: list[int], weights: np.ndarray
) -> tuple[list[int], np.ndarray]:
    """Fit the weights of the ``chosen`` columns, and drop those that would be negative: the inner loop of NNLS."""
    while True:
        columns = pulls[:, chosen]
        square = columns.T @ columns
        square[np.diag_indices_from(square)] *= 1.0 + 1e-12
        fitted = np.linalg.solve(square, columns.T @ target)
        if fitted.min() > 0.0:
            return chosen, fitted
        falling = fitted <= 0.0
        ratio = weights[falling] / np.maximum(weights[falling] - fitted[falling], 1e-300)
        weights = weights + ratio.min() * (fitted - weights)
        kept = weights > 1e-14 * max(float(weights.max()), 1e-300)
        if kept.all():
            kept[np.argmin(fitted)] = False
        chosen, weights = [c for c, keep in zip(chosen, kept, strict=True) if keep], weights[kept]
        if not chosen:
            return chosen, weights
