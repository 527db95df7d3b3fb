"""Bound the error of a single answer by conformal prediction with contacts as the unit.

Forces at one contact err alike, so a new contact is as new as one of those that are known, and a new sample is not:
hierarchical conformal prediction (Lee, Barber and Willett 2023, "Distribution-free inference with hierarchical data",
arXiv 2306.06342, section 3). Nothing is assumed of the errors but that contacts can be exchanged.
"""

import numpy as np

LEVEL = 0.9
"""Share of the answers at contacts that were never seen whose error the bound shall exceed."""
FEWEST = 9
"""Contacts from which on there is a bound of this level: of n + 1 contacts each may be the worst."""
_ROUNDING = 1e-9


def bound_factor(scores: np.ndarray, contact: np.ndarray) -> float:
    """Return the factor of an estimate that bounds the error at a new contact in LEVEL of the cases.

    scores : (n,) errors over estimates; contact : (n,) the contact of each
    Each contact weighs the same, and one that is still unknown may have any score. Infinite
    below FEWEST contacts.
    """
    _, unit, count = np.unique(contact, return_inverse=True, return_counts=True)
    weights = 1.0 / (count[unit] * (len(count) + 1))
    return float(quantiles(scores, weights[None])[0])


def finite(factor: float) -> float:
    """Return a factor of ``bound_factor`` as tables have it: empty (NaN) where there is no bound."""
    return factor if np.isfinite(factor) else np.nan


def quantiles(scores: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the least score whose own and smaller ones weigh LEVEL, for each row of ``weights`` (k, n): (k,)."""
    order = np.argsort(scores, kind="stable")
    reached = np.cumsum(weights[:, order], axis=1) >= LEVEL - _ROUNDING
    return np.where(reached.any(axis=1), scores[order][reached.argmax(axis=1)], np.inf)
