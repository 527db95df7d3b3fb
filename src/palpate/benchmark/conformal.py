"""Bound the error of a single answer by conformal prediction with contacts as the unit, and count how bounds hold.

Forces at one contact err alike, so a new contact is as new as one of those that are known, and a new sample is not:
hierarchical conformal prediction (Lee, Barber and Willett 2023, "Distribution-free inference with hierarchical data",
arXiv 2306.06342, section 3). Nothing is assumed of the errors but that contacts can be exchanged.
"""

from typing import NamedTuple

import numpy as np

LEVEL = 0.9
"""Share of the answers at contacts that were never seen whose error the bound shall exceed."""
FEWEST = 9
"""Contacts from which on there is a bound of this level: of n + 1 contacts each may be the worst."""
CONSTANT, OWN = "constant", "own"
"""What a bound is a factor of: the same for every answer, or what the model itself says of its answer."""
_ROUNDING = 1e-9


def bound_factor(scores: np.ndarray, contact: np.ndarray) -> float:
    """Return the factor of an estimate that bounds the error at a new contact in LEVEL of the cases.

    scores : (n,) errors over estimates; contact : (n,) the contact of each
    Each contact weighs the same, and one that is still unknown may have any score. Infinite
    below FEWEST contacts.
    """
    _, unit, count = np.unique(contact, return_inverse=True, return_counts=True)
    if not len(count):
        return np.inf
    weights = 1.0 / (count[unit] * (len(count) + 1))
    return float(quantiles(scores, weights[None])[0])


def bounds(errors: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Return ``bound_factor`` of each row of ``errors`` (m, n), of its samples that are not NaN: (m,)."""
    known = np.isfinite(errors)
    return np.array([bound_factor(row[there], contact[there]) for row, there in zip(errors, known, strict=True)])


def finite(factor: float) -> float:
    """Return a factor of ``bound_factor`` as tables have it: empty (NaN) where there is no bound."""
    return factor if np.isfinite(factor) else np.nan


def quantiles(scores: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the least score whose own and smaller ones weigh LEVEL, for each row of ``weights`` (k, n): (k,)."""
    order = np.argsort(scores, kind="stable")
    reached = np.cumsum(weights[:, order], axis=1) >= LEVEL - _ROUNDING
    return np.where(reached.any(axis=1), scores[order][reached.argmax(axis=1)], np.inf)


DRAWS = 300
"""Divisions of the contacts into those that a bound is found on and those that it is tried on."""
SEED = 1


class Coverage(NamedTuple):
    """The trial of bounds on contacts that they were not found on; empty (NaN) where there are too few contacts.

    coverage : share of the held-out answers whose error stays below their bound, over all draws
    coverage_low : the fifth percentile over the draws of that share
    coverage_of_contacts : share of the held-out contacts all of whose answers do
    sharpness : median of bound over error
    """

    coverage: float = np.nan
    coverage_low: float = np.nan
    coverage_of_contacts: float = np.nan
    sharpness: float = np.nan


class Draws:
    """DRAWS seeded divisions of the contacts (n,) of samples into those that calibrate and those that try.

    FEWEST calibrate, or, where one is left to try, 19, 29 and so on: with these a bound is no larger than LEVEL asks.
    """

    def __init__(self, contact: np.ndarray):
        _, self._unit, count = np.unique(contact, return_inverse=True, return_counts=True)
        total = len(count)
        step = round(1.0 / (1.0 - LEVEL))
        calibrate = max(FEWEST, total // step * step - 1)
        draws = DRAWS if total > calibrate else 0
        ranks = np.random.default_rng(SEED).permuted(np.tile(np.arange(total), (draws, 1)), axis=1)
        self._held = (ranks >= calibrate)[:, self._unit]
        self._weights = ~self._held / (count[self._unit] * (calibrate + 1.0))

    def coverage(self, errors: np.ndarray, estimate: np.ndarray) -> Coverage:
        """Try bounds on ``errors`` (n,) that are a factor times ``estimate`` (n,), positive."""
        if not len(self._held):
            return Coverage()
        factor = quantiles(errors / estimate, self._weights)
        bound = factor[:, None] * estimate
        kept, held = errors <= bound * (1 + _ROUNDING), self._held
        shares = (kept & held).sum(axis=1) / held.sum(axis=1)
        ratio = (bound / np.maximum(errors, np.finfo(float).tiny))[held]
        missed = self._contacts(held & ~kept).sum() / self._contacts(held).sum()
        over_all = (kept & held).sum() / held.sum()
        return Coverage(*map(float, (over_all, np.quantile(shares, 0.05), 1.0 - missed, np.median(ratio))))

    def _contacts(self, samples: np.ndarray) -> np.ndarray:
        """Mark the contacts that have any of the marked ``samples`` (draws, n), (draws, contacts)."""
        marked = np.zeros((len(samples), self._unit.max() + 1), dtype=bool)
        draw, sample = np.nonzero(samples)
        marked[draw, self._unit[sample]] = True
        return marked
