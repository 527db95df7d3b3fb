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
    most = min(pulls.shape)
    fit = _Fit(target, most)
    while np.linalg.norm(fit.left) > tolerance * np.linalg.norm(target) and len(fit.chosen) < most:
        likeness = (fit.left.astype(np.float32) @ rough) / size
        likeness[fit.chosen] = -np.inf
        best = int(np.argmax(likeness))
        if not likeness[best] > 0.0:
            break
        fit.take(best, pulls[:, best])
    return np.array(fit.chosen, dtype=int), fit.weights


class _Fit:
    """The columns that are chosen, their weights, and what is left of the target (rows,); at most ``most`` of them."""

    def __init__(self, target: np.ndarray, most: int):
        self.chosen: list[int] = []
        self.weights: np.ndarray = np.empty(0)
        self.left, self._target = target, target
        # the columns as rows, their products, and those with the target; only the first of them are in use
        self._columns, self._square, self._aim = np.empty((most, len(target))), np.empty((most, most)), np.empty(most)

    def take(self, number: int, column: np.ndarray) -> None:
        """Take one column more, and drop those whose weights would be negative: the inner loop of NNLS."""
        j = len(self.chosen)
        self._columns[j], self._aim[j] = column, column @ self._target
        self._square[j, : j + 1] = self._square[: j + 1, j] = self._columns[: j + 1] @ column
        self._square[j, j] *= 1.0 + 1e-12
        self.chosen, self.weights = [*self.chosen, number], np.append(self.weights, 0.0)
        while self.chosen and not self._fitted():
            pass
        self.left = self._target - self.weights @ self._columns[: len(self.chosen)]

    def _fitted(self) -> bool:
        """Fit the weights, or go as far towards the fit as none is negative, and drop those that are zero there."""
        j = len(self.chosen)
        fitted = np.linalg.solve(self._square[:j, :j], self._aim[:j])
        if fitted.min() > 0.0:
            self.weights = fitted
            return True
        falling = fitted <= 0.0
        ratio = self.weights[falling] / np.maximum(self.weights[falling] - fitted[falling], 1e-300)
        weights = self.weights + ratio.min() * (fitted - self.weights)
        kept = weights > 1e-14 * max(float(weights.max()), 1e-300)
        if kept.all():
            kept[np.argmin(fitted)] = False
        self._keep(np.flatnonzero(kept), weights)
        return False

    def _keep(self, rows: np.ndarray, weights: np.ndarray) -> None:
        count = len(rows)
        self.chosen, self.weights = [self.chosen[k] for k in rows], weights[rows]
        self._columns[:count], self._aim[:count] = self._columns[rows], self._aim[rows]
        self._square[:count, :count] = self._square[np.ix_(rows, rows)]
