"""Reduce by proper orthogonal decomposition and interpolate by radial basis functions: the usual reduced-order rival.

This is what the EZyRB library does; it comes with a GPU build of torch of several GB, so scipy's
RBFInterpolator stands in for it.
"""

from functools import partial

import numpy as np
from scipy.interpolate import RBFInterpolator

from palpate.benchmark.accuracy import Method
from palpate.benchmark.model import Case
from palpate.models import kinds
from palpate.models.coarse_answers import Enriched, enriched
from palpate.models.enrichment.paper_enrichment import median_distance, squared_distances
from palpate.models.enrichment.training_samples import Training

KERNELS = [("linear", 1.0)] + [
    (name, shape) for name in ("multiquadric", "gaussian") for shape in np.geomspace(0.01, 10, 7).tolist()
]
"""The kernels tried with their ε, relative to the reciprocal median distance of the features."""


class PodRbf(Method):
    """Fine displacements in POD modes, whose coefficients are interpolated from coarse surface displacements.

    Cross-validation chooses the kernel, its width and, unless ``modes`` are given, their number.
    """

    def __init__(self, training: Training, modes: int | None = None):
        self._surface = training.db.coarse_surface
        described = training.described
        # unit median distance: RBFInterpolator's ε and its constant term then mean the same for every body
        self._scale = median_distance(squared_distances(described, described))
        fine = training.db.fine.reshape(len(described), -1)
        kernel, shape, modes = self._choose(training, described / self._scale, fine @ fine.T, modes)
        self._mean = fine.mean(axis=0)
        gram = (fine - self._mean) @ (fine - self._mean).T
        vectors = np.linalg.eigh(gram)[1][:, ::-1][:, :modes]
        # row j is mode j times its singular value, so that the samples' coefficients are ``vectors``
        self._modes = vectors.T @ (fine - self._mean)
        self._coefficients = _interpolator(described / self._scale, vectors, kernel, shape)

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        coefficients = self._coefficients(coarse[self._surface].reshape(1, -1) / self._scale)[0]
        return (self._mean + coefficients @ self._modes).reshape(-1, 3)

    @staticmethod
    def _choose(
        training: Training, described: np.ndarray, gram: np.ndarray, modes: int | None
    ) -> tuple[str, float, int]:
        """Return the kernel, its shape and the number of modes with the least cross-validated error."""
        counts = np.unique(np.geomspace(1, len(gram), 12).astype(int)) if modes is None else np.array([modes])

        def blends(train: np.ndarray, validation: np.ndarray) -> np.ndarray:
            k = len(train)
            centre = np.eye(k) - 1.0 / k
            vectors = np.linalg.eigh(centre @ gram[np.ix_(train, train)] @ centre)[1][:, ::-1]
            candidates = []
            for kernel, shape in KERNELS:
                weights = _interpolator(described[train], np.eye(k), kernel, shape)(described[validation]).T
                # the blend of samples that m modes leave: mean + centred projection of the interpolant
                candidates += [1 / k + centre @ (vectors[:, :m] @ (vectors[:, :m].T @ weights)) for m in counts]
            return np.array(candidates)

        best_candidate = int(training.errors(gram, blends).mean(axis=1).argmin())
        return *KERNELS[best_candidate // len(counts)], int(counts[best_candidate % len(counts)])


def _interpolator(points: np.ndarray, values: np.ndarray, kernel: str, shape: float) -> RBFInterpolator:
    # a trace of smoothing keeps duplicate samples from making the system singular
    return RBFInterpolator(points, values, kernel=kernel, epsilon=shape, degree=0, smoothing=1e-10)


def prepare(case: Case, model: kinds.PODRBF) -> Enriched:
    """Choose kernel and width by cross-validation on the training samples."""
    return enriched(case, model.coarse, None, partial(PodRbf, modes=model.modes))
