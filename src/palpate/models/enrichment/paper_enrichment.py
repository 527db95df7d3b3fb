"""Enrich a coarse answer as paper 1 does: blend fine deformations of training samples, equations (1) to (4).

Offline are the kernel matrix and its width σ, by cross-validation; online the weights of a query and the blend.
The final blend A w is normalised to sum 1, not w: only so does a training sample, whose A w is a unit vector, reproduce
itself. Equation (4) word for word, where w sums to 1, is the kind LITERAL. The signed weights of a query far from all
samples can cancel. Where their sum is below 1e-3 of the sum of their magnitudes, dividing by it would magnify errors a
thousandfold, so the normalised kernel values take their place (also where non-negative weights all vanish).
"""

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import nnls
from scipy.spatial.distance import cdist

from palpate.benchmark.accuracy import Method
from palpate.benchmark.model import Case
from palpate.models.coarse_answers import Enriched, enriched
from palpate.models.enrichment.features import describe, features_of
from palpate.models.enrichment.training_samples import Training
from palpate.models.kinds import PaperEnrichment

WEIGHTS = ("signed", "nonnegative_a", "nonnegative_b", "clipped")  # kinds of weights, which ``BlendWeights`` explains
LITERAL = "literal"
"""Equation (4) of the paper word for word: w sums to 1 and not A w, with A as in nonnegative_a. Only the study of the
premises asks for it: a training sample does not reproduce itself."""
SINGULAR = 1e-12
CANCELLED = 1e-3


def squared_distances(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return ‖a − b‖² of rows a (p, r) and b (q, r), (p, q) [m²], from differences: equal rows give exactly 0."""
    return cdist(rows, columns, "sqeuclidean")


def gaussian(squared: np.ndarray, sigma: float) -> np.ndarray:
    """Return exp(−d²/2σ²), equations (2) and (4), of squared distances [m²] and σ [m] > 0.

    Divides by σ twice because σ² underflows long before σ does; exp of −∞ is the 0 that is wanted.
    """
    with np.errstate(over="ignore", under="ignore"):
        return np.exp(squared / sigma / (-2.0 * sigma))


def query_weights(squared: np.ndarray, sigma: float) -> np.ndarray:
    """Return kernel values of queries, scaled so that the nearest training sample of each query has 1.

    squared : (k,) or (k, q), from k training samples to one or q queries [m²]
    The scale is the η of equation (4) in another form: it drops out when blend weights are normalised, and keeps a
    query 10⁶ σ away from having no weights at all. A query whose squared distances overflow is as far from every
    sample.
    """
    squared = np.minimum(squared, np.finfo(float).max)
    return gaussian(squared - squared.min(axis=0), sigma)


def eigen(kernel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues (k,), rising, and the eigenvectors (k, k) of a symmetric kernel matrix.

    Trap: divide and conquer, which numpy uses, may not converge where a Gaussian's values are denormal; this is QR.
    """
    return eigh(kernel, driver="ev")


def inverse(phi: np.ndarray) -> np.ndarray:
    """Invert a symmetric kernel matrix (k, k), leaving out eigenvalues below 1e-12 of the largest.

    Φ is singular with duplicate samples (each then gets the same weight) and nearly so for large σ, where
    every entry tends to 1 (the weights then tend to 1/k). Without the cut rounding errors would be magnified
    there; with it training samples are no longer reproduced exactly where it bites.
    """
    values, vectors = eigen(phi)
    regular = values > SINGULAR * values[-1]
    return (vectors[:, regular] / values[regular]) @ vectors[:, regular].T


class BlendWeights:
    """Weights of k training samples for any query, with one of WEIGHTS or ``LITERAL``.

    signed : A = Φ⁻¹; clipped : its negative entries set to 0
    nonnegative_a : the paper's nearest non-negative matrix read column by column, min ‖Φ a_j − e_j‖, a_j ≥ 0
    nonnegative_b : read query by query, min ‖Φ a − φ‖, a ≥ 0, a being the blend weights themselves
    literal : A of nonnegative_a times a w that sums to 1, so that what is blended may sum to anything
    """

    def __init__(self, kind: str, squared: np.ndarray, sigma: float):
        """Build the matrix; squared : (k, k) distances between training features [m²]; sigma [m]."""
        phi = gaussian(squared, sigma)
        self.sigma = sigma
        self._per_query, self._literal = kind == "nonnegative_b", kind == LITERAL
        if self._per_query:
            self._matrix = phi
        elif kind in ("nonnegative_a", LITERAL):
            self._matrix = np.column_stack([nnls(phi, unit)[0] for unit in np.eye(len(phi))])
        else:
            self._matrix = inverse(phi) if kind == "signed" else np.maximum(inverse(phi), 0.0)

    def __call__(self, squared: np.ndarray) -> np.ndarray:
        """Return weights (k,) or (k, q) from squared distances to one or q queries [m²].

        Columns sum to 1, except those of the literal kind.
        """
        w = query_weights(squared, self.sigma)
        if self._literal:
            return self._matrix @ (w / w.sum(axis=0))
        if not self._per_query:
            return normalise(self._matrix @ w, w)
        columns = w.reshape(len(w), -1).T
        blend = np.column_stack([nnls(self._matrix, column)[0] for column in columns])
        return normalise(blend.reshape(w.shape), w)


def normalise(blend: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return ``blend`` over its column sums, or ``w`` over its own in columns where those of ``blend`` cancel."""
    total = blend.sum(axis=0)
    cancelled = ~(np.abs(total) > CANCELLED * np.abs(blend).sum(axis=0))
    if not cancelled.any():
        return blend / total
    total = np.where(cancelled, 1.0, total)
    return np.where(cancelled, w / w.sum(axis=0), blend / total)


class DescribedSamples:
    """The training samples described by one kind of feature, shared by all kinds of weights.

    kind : one of FEATURES; neighbours : nodes of an ordered one, None for those of the training's options
    described : (k, r) features [m]; slots : (k, 3n) fine displacements [m]
    squared : (k, k) squared distances between features [m²]; scale : their median distance [m]
    """

    def __init__(self, training: Training, kind: str, neighbours: int | None = None):
        db, options = training.db, training.options
        self.training, self.features = training, features_of(db, kind, neighbours or options.neighbours)
        self.described, self.slots = describe(self.features, db.contact, training.coarse, db.fine)
        self.squared = squared_distances(self.described, self.described)
        self.scale = median_distance(self.squared)
        widths = options.sigma_relative
        self.sigmas = self.scale * np.geomspace(widths.min, widths.max, widths.count)

    def choose_sigma(self, kind: str) -> float:
        """Return the σ [m] of the grid with the least cross-validated error for a ``kind`` of weights."""

        def blends(train: np.ndarray, validation: np.ndarray) -> np.ndarray:
            among, across = self.squared[np.ix_(train, train)], self.squared[np.ix_(train, validation)]
            return np.array([BlendWeights(kind, among, sigma)(across) for sigma in self.sigmas])

        errors = self.training.errors(self.slots @ self.slots.T, blends)
        return float(self.sigmas[errors.mean(axis=1).argmin()])


class Blend(Method):
    """A fitted regressor: one kind of feature, one kind of weights, one σ."""

    def __init__(self, samples: DescribedSamples, kind: str, sigma: float):
        self.sigma_m, self.features = sigma, samples.features
        self._described, self._slots = samples.described, samples.slots
        self._weights = BlendWeights(kind, samples.squared, sigma)

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        view = self.features.view(contact)
        away = self._described - view.feature(coarse)
        weights = self._weights(np.einsum("ij,ij->i", away, away))
        return view.from_slots(weights @ self._slots)


def fit(training: Training, features: str, weights: str, neighbours: int | None = None) -> Blend:
    """Return a regressor, with σ by cross-validation; ``neighbours`` replaces those of the options."""
    samples = training.share((features, neighbours), lambda: DescribedSamples(training, features, neighbours))
    return Blend(samples, weights, samples.choose_sigma(weights))


def median_distance(squared: np.ndarray) -> float:
    """Return the median distance [m] between different samples, from squared ones (k, k); 1 if there are none.

    Samples that are present twice do not change it.
    """
    distances = np.sqrt(squared[np.triu_indices(len(squared), 1)])
    distances = distances[distances > 0.0]
    return float(np.median(distances)) if len(distances) else 1.0


class LinearRegressor(Method):
    """x_f = Xf (XcᵀXc)⁻¹ Xcᵀ x_c: the linear map of least norm through all training samples, without any σ.

    Weights are not normalised, so that a press twice as hard is answered by twice the displacement. With more samples
    than numbers in a feature vector XcᵀXc is singular, and its pseudoinverse gives the map of least squares.
    """

    def __init__(self, training: Training, features: str):
        samples = training.share((features, None), lambda: DescribedSamples(training, features))
        self._features, self._described = samples.features, samples.described
        self._dual = inverse(self._described @ self._described.T) @ samples.slots

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        view = self._features.view(contact)
        return view.from_slots((self._described @ view.feature(coarse)) @ self._dual)


def prepare(case: Case, model: PaperEnrichment) -> Enriched:
    """Return the regressor on coarse answers, with σ by cross-validation and nodes ordered around all contacts."""

    def ordered(training: Training) -> Blend:
        method = fit(training, model.features, model.weights, model.neighbours)
        for contact in training.db.coarse_surface:
            method.features.view(int(contact))  # which keeps the order of its nodes, so that no query sorts
        return method

    return enriched(case, model.coarse, model.samples, ordered)
