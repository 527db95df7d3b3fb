"""The Pareto front against brute force."""

import numpy as np
import pytest

from palpate.benchmark.ranking import front


def brute_force(cost, error):
    finite = np.isfinite(cost) & np.isfinite(error)
    kept = []
    for i in np.flatnonzero(finite):
        no_worse = finite & (cost <= cost[i]) & (error <= error[i])
        if not (no_worse & ((cost < cost[i]) | (error < error[i]))).any():
            kept.append(i)
    return set(kept)


@pytest.mark.parametrize("seed", range(5))
def test_same_as_brute_force_with_ties_and_failures(seed):
    random = np.random.default_rng(seed)
    cost, error = random.integers(0, 6, (2, 30)).astype(float)
    error[random.integers(0, 30, 3)] = np.nan
    cost[random.integers(0, 30, 3)] = np.inf
    found = front(cost, error)
    assert set(found) == brute_force(cost, error)
    assert (np.diff(cost[found]) >= 0).all()


def test_nothing_finite_gives_an_empty_front():
    assert front([np.nan, 1.0], [1.0, np.inf]).size == 0
