"""Fit how strongly the linear detail is applied: two coefficients, by ridge regression, and bounds."""

from typing import NamedTuple

import numpy as np

from palpate.models.enrichment.training_samples import Training

PENALTIES = np.geomspace(1e-6, 1e2, 17)
"""The ridge penalties tried, relative to the mean square of the regressors; the scale 1 is tried too."""


class Scale(NamedTuple):
    """1 + β · (ratios − 1), with two numbers ``beta`` (2,), at least ``low`` and at most ``high``."""

    beta: np.ndarray
    low: float = -np.inf
    high: float = np.inf

    def of(self, ratios: np.ndarray) -> np.ndarray:
        """Return the scale of each row of ``ratios`` (..., 2)."""
        return np.clip(1.0 + (ratios - 1.0) @ self.beta, self.low, self.high)


def fit_scale(ratios: np.ndarray, detail: np.ndarray, missing: np.ndarray, training: Training) -> Scale:
    """Find the scale with which detail fits best what interpolation is ``missing``.

    ratios : (k, 2); detail, missing : (k, n, 3) [m]
    Samples count by the square of their relative error. The training folds, which hold out contacts if the split does,
    choose by cross-validation: the penalty of the ridge, whether the scale stays among those of the samples that it
    was fitted to, and whether it is 1 instead.
    """
    inner = _inner(detail, detail) / training.peaks**2
    across = _inner(missing - detail, detail) / training.peaks**2
    left = _inner(missing - detail, missing - detail) / training.peaks**2

    def solve(known: np.ndarray, penalty: float, bounded: bool) -> Scale:
        regressors = ratios[known] - 1.0
        normal = regressors.T @ (regressors * inner[known, None])
        if not normal.trace() > 0.0:
            return Scale(np.zeros(2))
        ridge = penalty * normal.trace() * np.eye(2)
        found = Scale(np.linalg.solve(normal + ridge, regressors.T @ across[known]))
        scales = found.of(ratios[known])
        return Scale(found.beta, float(scales.min()), float(scales.max())) if bounded else found

    def error(asked: np.ndarray, scale: Scale) -> float:
        extra = scale.of(ratios[asked]) - 1.0
        squared = left[asked] - 2.0 * extra * across[asked] + extra**2 * inner[asked]
        return float(np.sqrt(np.maximum(squared, 0.0)).sum())

    parts = [np.flatnonzero(training.fold == part) for part in range(training.fold.max() + 1)]
    rest = [np.flatnonzero(training.fold != part) for part in range(training.fold.max() + 1)]
    tried = [(penalty, bounded) for bounded in (True, False) for penalty in PENALTIES]
    scores = [sum(error(a, solve(k, *each)) for a, k in zip(parts, rest, strict=True)) for each in tried]
    everything = np.arange(len(ratios))
    if min(scores) >= error(everything, Scale(np.zeros(2))):
        return Scale(np.zeros(2))
    return solve(everything, *tried[int(np.argmin(scores))])


def _inner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("kni,kni->k", a, b)
