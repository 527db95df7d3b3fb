"""Few columns for many: those that hardly pull are never taken."""

import numpy as np

from palpate.models.contact_modes.reduced_contact import few_of


def test_a_column_that_does_not_pull_is_not_taken():
    """Rounding is as like what is left as anything: such a column would get a weight beyond all others."""
    draw = np.random.default_rng(0)
    pulls = np.hstack([draw.random((20, 40)), 1e-25 * draw.normal(size=(20, 4000))])
    target = pulls.sum(axis=1)
    chosen, weights = few_of(pulls, target, 1e-3)
    assert chosen.max() < 40 and weights.max() < 1e3
    assert np.linalg.norm(pulls[:, chosen] @ weights - target) <= 1e-3 * np.linalg.norm(target)
