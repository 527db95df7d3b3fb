"""Bound the error of a single answer by conformal prediction with contacts as the unit, and count how bounds hold.

Forces at one contact err alike, so a new contact is as new as one of those that are known, and a new sample is not:
hierarchical conformal prediction (Lee, Barber and Willett 2023, "Distribution-free inference with hierarchical data",
arXiv 2306.06342, section 3). Nothing is assumed of the errors but that contacts can be exchanged.
"""

from typing import NamedTuple

import numpy as np

LEVEL = 0.9
"""Share of the answers at new contacts whose error stays below a bound."""
FEWEST = 9
"""Contacts from which on there is a bound of this level: of n + 1 contacts each may be the worst."""
CONSTANT, OWN = "constant", "own"
"""What a bound is a factor of: the same for every answer, or what the model itself says of its answer."""
_ROUNDING = 1e-9


def bound_factor(scores: np.ndarray, contact: np.ndarray) -> float:
    """Return the factor by which an estimate is multiplied to bound the error at a new contact in LEVEL of the cases.

    scores : (n,) errors over estimates; contact : (n,) the contact of each
    Each contact weighs the same, and the new one counts as one of any score: infinite below FEWEST contacts.
    """
    return float(_factors(scores[None], contact)[0])


def bounds(errors: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Return the bound (m,) of each row of ``errors`` (m, n): ``bound_factor`` of its samples that are not NaN."""
    is_asked, factors = np.isfinite(errors), np.empty(len(errors))
    for asked in {row.tobytes(): row for row in is_asked}.values():
        rows = (is_asked == asked).all(axis=1)
        factors[rows] = _factors(errors[rows][:, asked], contact[asked])
    return factors


def _factors(scores: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Return the ``bound_factor`` (m,) of each row of ``scores`` (m, n): a quantile in which contacts weigh alike."""
    _, contact_index, samples_of = np.unique(contact, return_inverse=True, return_counts=True)
    if not len(samples_of):
        return np.full(len(scores), np.inf)
    order = np.argsort(scores, axis=1, kind="stable")
    weights = 1.0 / (samples_of[contact_index] * (len(samples_of) + 1))
    is_reached = np.cumsum(weights[order], axis=1) >= LEVEL - _ROUNDING
    first_reached = np.take_along_axis(order, is_reached.argmax(axis=1)[:, None], axis=1)
    return np.where(is_reached.any(axis=1), np.take_along_axis(scores, first_reached, axis=1)[:, 0], np.inf)


def finite(factor: float) -> float:
    """Return a factor of ``bound_factor`` as tables have it: empty (NaN) where there is no bound."""
    return factor if np.isfinite(factor) else np.nan


def quantiles(scores: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the quantile LEVEL of ``scores`` (n,) by each row of ``weights`` (k, n): (k,), infinite if not reached."""
    order = np.argsort(scores, kind="stable")
    reached = np.cumsum(weights[:, order], axis=1) >= LEVEL - _ROUNDING
    return np.where(reached.any(axis=1), scores[order][reached.argmax(axis=1)], np.inf)


DRAWS = 300
"""Divisions of the contacts into those that a bound is found on and those that it is tried on."""
SEED = 1


class Coverage(NamedTuple):
    """How often bounds hold at contacts that they were not found on; empty (NaN) where there are too few contacts.

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
    """DRAWS random divisions of the contacts of n samples: bounds are found on one part, and tried on the other.

    contact : (n,) of each sample
    Bounds are found on FEWEST contacts or, where one is left to try, on 19, 29 and so on: so many that a bound is no
    larger than LEVEL asks.
    """

    def __init__(self, contact: np.ndarray):
        _, self._unit, samples_of = np.unique(contact, return_inverse=True, return_counts=True)
        n_contacts = len(samples_of)
        per_level = round(1.0 / (1.0 - LEVEL))
        found_on = max(FEWEST, n_contacts // per_level * per_level - 1)
        n_draws = DRAWS if n_contacts > found_on else 0
        ranks = np.random.default_rng(SEED).permuted(np.tile(np.arange(n_contacts), (n_draws, 1)), axis=1)
        self._tried = (ranks >= found_on)[:, self._unit]
        self._weights = ~self._tried / (samples_of[self._unit] * (found_on + 1.0))

    def coverage(self, errors: np.ndarray, estimate: np.ndarray) -> Coverage:
        """Try bounds of ``errors`` (n,) that are a factor times ``estimate`` (n,), which is positive."""
        if not len(self._tried):
            return Coverage()
        factor = quantiles(errors / estimate, self._weights)
        bound = factor[:, None] * estimate
        tried, is_below = self._tried, errors <= bound * (1 + _ROUNDING)
        share_of_draw = (is_below & tried).sum(axis=1) / tried.sum(axis=1)
        sharpness = np.median((bound / np.maximum(errors, np.finfo(float).tiny))[tried])
        contacts_above = self._contacts(tried & ~is_below).sum() / self._contacts(tried).sum()
        share = (is_below & tried).sum() / tried.sum()
        return Coverage(*map(float, (share, np.quantile(share_of_draw, 0.05), 1.0 - contacts_above, sharpness)))

    def _contacts(self, samples: np.ndarray) -> np.ndarray:
        """Mark the contacts, (draws, contacts) bool, of which a sample is marked in ``samples`` (draws, n)."""
        marked = np.zeros((len(samples), self._unit.max() + 1), dtype=bool)
        draw, sample = np.nonzero(samples)
        marked[draw, self._unit[sample]] = True
        return marked


def bound_row(errors: np.ndarray, estimate: np.ndarray, contact: np.ndarray) -> dict[str, float]:
    """Return how well an ``estimate`` (n,) of ``errors`` (n,) orders them, and what a bound by it is worth.

    These are columns of error_bounds.csv: rank_correlation, bound_factor, and those of ``Coverage``.
    """
    from scipy.stats import spearmanr  # importing it takes most of a second

    vary = np.ptp(estimate) > 0 and np.unique(errors).size > 1
    row = {"rank_correlation": float(spearmanr(errors, estimate).statistic) if vary else np.nan}
    row |= {"bound_factor": finite(bound_factor(errors / estimate, contact))}
    with np.errstate(invalid="ignore"):  # how sharp an infinite bound of a failure is
        tried = Draws(contact).coverage(errors, estimate)
    return row | tried._asdict()
