"""Blend fine deformations of the database: the paper's regressor, equation (1)."""

import numpy as np

from palpate.models.enrichment.blend_weights import BlendWeights
from palpate.models.enrichment.feature_vectors import Features, describe, in_slots, kinds
from palpate.models.enrichment.fit_inputs import Fitting
from palpate.models.enrichment.gaussian_kernel import squared_distances
from palpate.models.enrichment.training_samples import FitOptions, Training


class Known:
    """The training samples as one kind of feature sees them, shared by all kinds of weights.

    described : (k, r) features [m]; slots : (k, 3n) fine displacements [m]
    squared : (k, k) squared distances between features [m²]; scale : their median distance [m]
    """

    def __init__(self, features: Features, training: Training, options: FitOptions):
        self.features, self.training = features, training
        self.described = describe(features, training.contact, training.coarse)
        self.slots = in_slots(features, training.contact, training.fine)
        self.squared = squared_distances(self.described, self.described)
        self.scale = median_distance(self.squared)
        grid = options.sigma_relative
        self.sigmas = self.scale * np.geomspace(grid["min"], grid["max"], int(grid["count"]))

    def choose_sigma(self, kind: str) -> float:
        """Return the σ [m] of the grid with the smallest cross-validated error for one kind of weights."""

        def blends(known: np.ndarray, asked: np.ndarray) -> np.ndarray:
            among, across = self.squared[np.ix_(known, known)], self.squared[np.ix_(known, asked)]
            return np.array([BlendWeights(kind, among, sigma)(across) for sigma in self.sigmas])

        return float(self.sigmas[self.training.score(self.slots @ self.slots.T, blends).argmin()])


class Blend:
    """A fitted regressor: one kind of feature, one kind of weights, one σ."""

    def __init__(self, known: Known, kind: str, sigma: float):
        self.sigma_m = sigma
        self._features, self._described, self._slots = known.features, known.described, known.slots
        self._weights = BlendWeights(kind, known.squared, sigma)

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes, (N, 3) [m]."""
        view = self._features.view(contact)
        away = self._described - view.feature(coarse)
        weights = self._weights(np.einsum("ij,ij->i", away, away))
        return view.from_slots(weights @ self._slots)

    def order_ahead(self, contacts: np.ndarray) -> None:
        """Find the order of the nodes around each of ``contacts`` in advance, so that no query sorts."""
        for contact in contacts:
            self._features.view(int(contact))


def fit(fitting: Fitting, features: str, weights: str, neighbours: int | None = None) -> Blend:
    """Fit a regressor, its σ by cross-validation; ``neighbours`` other than those of the options may be given."""
    length = fitting.options.neighbours if neighbours is None else neighbours
    known = fitting.share(
        (features, length), lambda: Known(kinds(fitting.db, length)[features], fitting.training, fitting.options)
    )
    return Blend(known, weights, known.choose_sigma(weights))


def median_distance(squared: np.ndarray) -> float:
    """Return the median distance [m] between different samples, from squared ones (k, k); 1 if there are none.

    Samples that are present twice do not change it.
    """
    distances = np.sqrt(squared[np.triu_indices(len(squared), 1)])
    distances = distances[distances > 0.0]
    return float(np.median(distances)) if len(distances) else 1.0
