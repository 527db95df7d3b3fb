"""Regress fine on coarse displacements with a ridge, linearly or through a kernel: two rivals.

Both are solved in dual form, (K + λ I)⁻¹ of the k × k kernel matrix, because a sample has far more numbers
than there are samples. All settings are chosen by cross-validation on the training samples.
"""

import numpy as np

from palpate.benchmark.accuracy import Method
from palpate.benchmark.model import Case
from palpate.models import kinds
from palpate.models.coarse_answers import Enriched, enriched
from palpate.models.enrichment.paper_enrichment import eigen, gaussian, median_distance, squared_distances
from palpate.models.enrichment.training_samples import Training

LAMBDAS = np.geomspace(1e-12, 1e2, 29)  # the λ tried, relative to the mean eigenvalue of the kernel matrix


def dual_weights(among: np.ndarray, across: np.ndarray, lambdas: np.ndarray) -> np.ndarray:
    """Return (K + λ I)⁻¹ k of every λ and query, (λ, s, q): K = ``among`` (s, s) samples, k = ``across`` (s, q)."""
    values, vectors = eigen(among)
    damped = np.maximum(values, 0.0) + lambdas[:, None] * among.trace() / len(among)
    return vectors @ ((vectors.T @ across) / damped[:, :, None])


def _choose(training: Training, kernel: np.ndarray, gram: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the cross-validated errors (k,) of the best λ, and that λ, for one ``kernel`` matrix (k, k).

    gram : (k, k) inner products of the targets [m²]
    """

    def blends(train: np.ndarray, validation: np.ndarray) -> np.ndarray:
        return dual_weights(kernel[np.ix_(train, train)], kernel[np.ix_(train, validation)], LAMBDAS)

    errors = training.errors(gram, blends)
    best_row = int(errors.mean(axis=1).argmin())
    return errors[best_row], float(LAMBDAS[best_row])


def _solve(kernel: np.ndarray, targets: np.ndarray, relative: float) -> np.ndarray:
    """Return dual coefficients (k, 3n): their blend with kernel values of a query is the prediction."""
    return dual_weights(kernel, np.eye(len(kernel)), np.array([relative]))[0] @ targets


def _detail(training: Training) -> np.ndarray:
    """Return what linear interpolation lacks, fine − P coarse, (k, 3n) [m]."""
    interpolated = np.array([training.db.prolongation @ coarse for coarse in training.coarse])
    return (training.db.fine - interpolated).reshape(len(interpolated), -1)


class RidgeUpsampling(Method):
    """A linear map from coarse surface to fine displacements.

    The ridge pulls the map toward nothing or toward linear interpolation, whichever cross-validates better.
    """

    def __init__(self, training: Training):
        self._surface, self._described = training.db.coarse_surface, training.described
        kernel = self._described @ self._described.T
        fine, detail = training.db.fine.reshape(len(kernel), -1), _detail(training)
        (to_zero, zero_lambda), (to_linear, linear_lambda) = (
            _choose(training, kernel, targets @ targets.T) for targets in (fine, detail)
        )
        linear = to_linear.mean() <= to_zero.mean()
        self._prolongation = training.db.prolongation if linear else None
        self._dual = _solve(kernel, detail, linear_lambda) if linear else _solve(kernel, fine, zero_lambda)

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        blend = ((self._described @ coarse[self._surface].ravel()) @ self._dual).reshape(-1, 3)
        return blend if self._prolongation is None else blend + self._prolongation @ coarse


class KernelRidge:
    """Targets (k, 3n) [m] predicted from descriptions (k, r) [m] of the training samples, by kernel ridge regression.

    The kernel is (x·y)^p exp(−‖x − y‖²/2σ²), with the ``power`` p 1 or 2: for wide σ linear or quadratic, and 0 for a
    body at rest, which has no detail.
    ``errors`` (k,) are the cross-validated errors of the σ and λ chosen, RMSE / peak, and ``score`` is their mean.
    """

    def __init__(self, described: np.ndarray, targets: np.ndarray, training: Training, power: int = 1):
        self._described, self._power = described, power
        squared, products = squared_distances(described, described), (described @ described.T) ** power
        widths = training.options.sigma_relative
        sigmas = median_distance(squared) * np.geomspace(widths.min, widths.max, widths.count)
        gram = targets @ targets.T
        candidates = [_choose(training, products * gaussian(squared, sigma), gram) for sigma in sigmas]
        best_sigma = min(range(len(candidates)), key=lambda i: float(candidates[i][0].mean()))
        self.sigma_m, self.errors = float(sigmas[best_sigma]), candidates[best_sigma][0]
        self.score = float(self.errors.mean())
        self._dual = _solve(products * gaussian(squared, self.sigma_m), targets, candidates[best_sigma][1])

    def predict(self, query: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m] for one description (r,) [m]."""
        away = self._described - query
        kernel = (self._described @ query) ** self._power * gaussian(np.einsum("ij,ij->i", away, away), self.sigma_m)
        return (kernel @ self._dual).reshape(-1, 3)


class KernelRidgeDetail(Method):
    """Linear interpolation plus its detail by kernel ridge on all coarse surface displacements."""

    def __init__(self, training: Training):
        self._surface, self._prolongation = training.db.coarse_surface, training.db.prolongation
        self._learnt = KernelRidge(training.described, _detail(training), training)
        self.sigma_m = self._learnt.sigma_m

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        return self._prolongation @ coarse + self._learnt.predict(coarse[self._surface].ravel())


def prepare(case: Case, model: kinds.Ridge) -> Enriched:
    """Choose widths and ridges by cross-validation on the training samples."""
    return enriched(case, model.coarse, model.samples, KernelRidgeDetail if model.kernel else RidgeUpsampling)
