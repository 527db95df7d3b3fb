"""Weigh training samples: how much each contributes to the answer to a query, equations (3) and (4) of paper 1.

What is normalised to sum 1 is the final blend A w, not w: only so does a training sample, whose A w is a unit
vector, reproduce itself. Equation (4) word for word, where w sums to 1, is the kind ``blend_kinds.LITERAL``. The signed
weights of a query far from all samples can cancel. Where their sum is below 1e-3 of the sum of their magnitudes,
dividing by it would magnify errors a thousandfold, so the kernel values themselves, normalised, take their place (also
where non-negative weights all vanish).
"""

import numpy as np
from scipy.optimize import nnls

from palpate.models.enrichment.blend_kinds import LITERAL
from palpate.models.enrichment.gaussian_kernel import gaussian, query_weights

SINGULAR = 1e-12
CANCELLED = 1e-3


def inverse(phi: np.ndarray) -> np.ndarray:
    """Invert a symmetric kernel matrix (k, k), leaving out eigenvalues below 1e-12 of the largest.

    Φ is singular with duplicate samples (each then gets the same weight) and nearly so for large σ, where
    every entry tends to 1 (the weights then tend to 1/k). Without the cut rounding errors would be magnified
    there; with it training samples are no longer reproduced exactly where it bites.
    """
    values, vectors = np.linalg.eigh(phi)
    kept = values > SINGULAR * values[-1]
    return (vectors[:, kept] / values[kept]) @ vectors[:, kept].T


class BlendWeights:
    """Weights of k training samples for any query, with one of ``blend_kinds.WEIGHTS`` or ``LITERAL``.

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
        if kind == "signed":
            self._matrix = inverse(phi)
        elif kind == "clipped":
            self._matrix = np.maximum(inverse(phi), 0.0)
        elif kind in ("nonnegative_a", LITERAL):
            self._matrix = np.column_stack([nnls(phi, unit)[0] for unit in np.eye(len(phi))])
        else:
            self._matrix = phi

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
    """Divide ``blend`` by its column sums, or take ``w`` divided by its own where those of ``blend`` cancel."""
    total = blend.sum(axis=0)
    cancelled = ~(np.abs(total) > CANCELLED * np.abs(blend).sum(axis=0))
    if not cancelled.any():
        return blend / total
    total = np.where(cancelled, 1.0, total)
    return np.where(cancelled, w / w.sum(axis=0), blend / total)
