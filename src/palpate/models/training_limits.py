"""Extrapolate fine answers of training samples to the limit of nested levels, as a standard to hold models against."""

import numpy as np

from palpate.benchmark.load import loads_of
from palpate.benchmark.model import Case
from palpate.errors import NotConverged
from palpate.models.conformal import bound_factor
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.richardson import RATIOS, doubt, limit, ratio

_SHARE = (1 / 3, 1 / 1.2)
"""Of the last halving's change, what all further ones add: ratios of convergence of 4 and of 2.2, where two levels
show none."""
_TOLERANCE = 1e-3
"""Relative residual of the elements of the levels below, whose own error is far larger."""


class Limits:
    """The training samples, and the limit of nested levels for each; those without an answer on a level are left out.

    loads : k of them; contact : (k,); fine : (k, n_surface, 3) [m], the limit
    beyond : the median distance of the fine answers from it, RMSE over peak
    unknown : a bound of how far that is from the truth, RMSE over peak; infinite of too few contacts
    """

    def __init__(self, case: Case):
        db, last = case.use_training(), len(case.body.levels) - 1
        below = [
            (Simulation(case, level, _TOLERANCE, order=2), to_surface(case.body, level, 2))
            for level in range(max(0, last - 2), last)
        ]
        contact, self.loads, fine, beyond, unknown = [], [], [], [], []
        for load, at, answer in zip(loads_of(db.contact, db.force), db.contact, db.fine, strict=True):
            try:
                levels = np.array([*(up @ level.displacement(load) for level, up in below), answer])
            except NotConverged:
                continue
            found, far = _limit(levels)
            contact.append(at)
            self.loads.append(load)
            fine.append(found)
            beyond.append(distance(answer, found))
            unknown.append(distance(found + far, found))
        self.contact, self.fine = np.array(contact), np.array(fine)
        self.beyond = float(np.median(beyond)) if beyond else np.inf
        self.unknown = bound_factor(np.array(unknown), self.contact)


def _limit(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the limit (n, 3) [m] of ``levels`` (m, n, 3) [m], and how far it may be from the truth."""
    if len(levels) > 2 and RATIOS[0] <= ratio(levels) <= RATIOS[1]:
        return limit(levels), doubt(levels)
    least, most = _SHARE
    change = levels[-1] - levels[-2]
    return levels[-1] + 0.5 * (least + most) * change, 0.5 * (most - least) * change


def distance(moved: np.ndarray, fine: np.ndarray) -> float:
    """Return the RMS distance of two displacements (n_surface, 3) [m] over the peak of the second."""
    return float(np.sqrt(np.mean(np.sum((moved - fine) ** 2, axis=1))) / np.linalg.norm(fine, axis=1).max())
