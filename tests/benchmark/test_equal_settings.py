"""Choices that another run of the same measurement makes again."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.comparison import BY_ERROR, BY_TIME, CLOSE, EQUAL, EXACT, alone, lasting, pick


def table(*rows):
    return pd.DataFrame(rows, columns=["rmse_of_peak", "online_median_s", "memory_mb"])


@pytest.mark.parametrize(
    ("rows", "by", "chosen"),
    [
        ([(0.1, 1, 1), (0.2, 0.1, 1)], BY_ERROR, 0),
        ([(0.1, 1, 1), (0.104, 0.1, 1)], BY_ERROR, 1),  # errors tied: the clearly faster
        ([(0.1, 1, 5), (0.104, 0.9, 1)], BY_ERROR, 1),  # times tied too: the smaller
        ([(0.1, 1, 1), (0.104, 0.9, 1.05)], BY_ERROR, 0),  # all tied: the first
        ([(0.1, 1, 1), (0.2, 0.1, 1)], BY_TIME, 1),
        ([(0.1, 1.4, 1), (0.2, 1, 1)], BY_TIME, 0),  # times tied: the less wrong
        ([(0.0, 1, 1), (1e-9, 0.1, 1)], BY_ERROR, 1),  # both are all but exact
        ([(0.0, 1, 1), (1e-4, 0.1, 1)], BY_ERROR, 0),
    ],
)
def test_ties_are_broken_in_turn(rows, by, chosen):
    assert pick(table(*rows), by).name == chosen


@pytest.mark.parametrize("seed", range(10))
def test_the_lasting_front_is_what_nobody_clearly_beats(seed):
    random = np.random.default_rng(seed)
    seconds, error = random.lognormal(0, 1, (2, 30))
    error[3], error[7], seconds[4] = np.nan, 1e-9, np.inf
    seconds[5], error[5] = seconds[6], error[6]
    for i, kept in enumerate(lasting(seconds, error)):
        beaten = any(
            (t <= CLOSE * seconds[i] and e * EQUAL < error[i]) or (e <= EQUAL * error[i] and t * CLOSE < seconds[i])
            for t, e in zip(seconds, np.maximum(error, EXACT), strict=True)
        )
        assert kept == (np.isfinite(seconds[i] + error[i]) and not beaten)


def test_twins_are_both_kept():
    assert lasting([1.0, 1.1, 9.0], [1.0, 1.0, 2.0]).tolist() == [True, True, False]


def test_of_twins_the_first_stays():
    rows = table((0.1, 1, 1), (0.104, 1.4, 1), (0.104, 1.6, 1), (0.2, 1, 1), (1e-12, 5, 1), (1e-9, 6, 1))
    assert alone(rows).index.tolist() == [0, 2, 3, 4]


def test_the_lasting_front_bears_noise_that_changes_the_exact_one():
    """Medians that repeat within a fifth: decades apart in time, near ties in each decade."""
    random = np.random.default_rng(0)
    seconds = np.repeat([1e-5, 1e-3, 1e-1], 5) * np.tile(1 + 0.02 * np.arange(5), 3)
    error = np.repeat([0.3, 0.03, 0.003], 5) * np.tile(1 + 0.005 * np.arange(5), 3)
    exact, found = set(), set()
    for _ in range(50):
        noisy = seconds * random.uniform(0.9, 1.1, 15)
        best = [i for i in range(15) if not ((noisy < noisy[i]) & (error <= error[i])).any()]
        exact.add(tuple(best))
        found.add(tuple(lasting(noisy, error)))
    assert len(found) == 1
    assert len(exact) > 10
