"""Fit how strongly the linear detail is applied: two coefficients, by ridge regression."""

import numpy as np

from palpate.enrichment.training_samples import Training

PENALTIES = np.geomspace(1e-6, 1e2, 17)
"""The ridge penalties tried, relative to the mean square of the regressors; the scale 1 is tried too."""


def fit_scale(ratios: np.ndarray, detail: np.ndarray, missing: np.ndarray, training: Training) -> np.ndarray:
    """Find β (2,) with which (1 + β · (ratios − 1)) detail fits best what interpolation is ``missing``.

    ratios : (k, 2); detail, missing : (k, n, 3) [m]
    Samples count by the square of their relative error. The penalty is the one that cross-validates best over
    the training folds, which hold out contacts if the split does; β = 0 where no penalty beats it.
    """
    regressors = ratios - 1.0
    inner = _inner(detail, detail) / training.peaks**2
    across = _inner(missing - detail, detail) / training.peaks**2
    left = _inner(missing - detail, missing - detail) / training.peaks**2

    def solve(known: np.ndarray, penalty: float) -> np.ndarray:
        weighted = regressors[known] * inner[known, None]
        normal = regressors[known].T @ weighted
        ridge = penalty * normal.trace() * np.eye(2)
        if not normal.trace() > 0.0:
            return np.zeros(2)
        return np.linalg.solve(normal + ridge, regressors[known].T @ across[known])

    def error(asked: np.ndarray, beta: np.ndarray) -> float:
        extra = regressors[asked] @ beta
        squared = left[asked] - 2.0 * extra * across[asked] + extra**2 * inner[asked]
        return float(np.sqrt(np.maximum(squared, 0.0)).sum())

    parts = [np.flatnonzero(training.fold == part) for part in range(training.fold.max() + 1)]
    rest = [np.flatnonzero(training.fold != part) for part in range(training.fold.max() + 1)]
    scores = [sum(error(a, solve(k, p)) for a, k in zip(parts, rest, strict=True)) for p in PENALTIES]
    everything = np.arange(len(regressors))
    if min(scores) >= error(everything, np.zeros(2)):
        return np.zeros(2)
    return solve(everything, PENALTIES[int(np.argmin(scores))])


def _inner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("kni,kni->k", a, b)
