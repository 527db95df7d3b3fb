"""Compute the Gaussian kernel of paper 1 so that no σ and no distance makes it 0/0 or overflow."""

import numpy as np
from scipy.spatial.distance import cdist


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
    """Return kernel values of queries, scaled so that the nearest training sample of each has 1.

    squared : (k,) or (k, q), from k training samples to one or q queries [m²]
    The scale is the η of equation (4) in another form: it drops out when blend weights are normalised, and
    taking it off before exp is what keeps a query 10⁶ σ away from having no weights at all. A query whose squared
    distances overflow is as far from every sample.
    """
    squared = np.minimum(squared, np.finfo(float).max)
    return gaussian(squared - squared.min(axis=0), sigma)
