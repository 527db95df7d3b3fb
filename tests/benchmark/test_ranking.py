"""Draws of whole contacts."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.ranking import (
    BY_ERROR,
    DRAWS,
    EQUAL,
    EXACT,
    RANGE,
    TIED_TIMES,
    TRUTH,
    ZERO,
    alone,
    lasting,
    own_errors,
    pick,
    read_errors,
    resampled,
)


def test_an_unknown_own_error_is_the_largest_that_is_known():
    errors = pd.DataFrame({"model": TRUTH, "sample": [1, 1, 2, 3], "rmse_of_peak": [0.01, np.nan, np.nan, 0.04]})
    assert own_errors(errors, "rmse_of_peak", np.array([2, 1, 9, 3])).tolist() == [0.04, 0.01, 0.04, 0.04]
    nothing = errors.assign(rmse_of_peak=np.nan)
    assert np.isnan(own_errors(nothing, "rmse_of_peak", np.array([2, 1]))).all()
    assert np.isnan(own_errors(errors.assign(model=ZERO), "rmse_of_peak", np.array([2, 1]))).all()


@pytest.fixture
def means(trade_off):
    """Draws of the mean errors on test samples of one scene."""
    errors = trade_off[1]["liver_small"]
    return resampled(errors[errors["side"] == "test"], "rmse_of_peak")


def test_draws_are_those_of_contacts_not_of_samples(means):
    """The spread of a mean over 4 contacts is that of the contacts' means over the root of 4, whatever the forces."""
    drawn = means.loc[("detail_correction", "samples=60")]
    assert drawn.shape == (DRAWS,)
    assert drawn.mean() == pytest.approx(0.004, rel=0.01)
    assert drawn.std() == pytest.approx(0.004 * np.std([0.5, 1.0, 1.5, 1.0]) / 2, rel=0.05)
    low, high = drawn.quantile(list(RANGE))
    assert 0.5 * 0.004 < low < 0.004 < high < 1.5 * 0.004
    assert ("springs", "iterations=1") not in means.index  # it failed on a sample


def test_all_settings_see_the_same_draws(means):
    few, many = means.loc[("detail_correction", "samples=10")], means.loc[("detail_correction", "samples=60")]
    assert np.allclose(few / many, 2.5)  # in every draw, though both spread
    there = means.loc[("pod_rbf", "modes=8")] / 0.00412
    assert np.allclose(there + many / 0.004, 2)  # what is hard for one is easy for the other


def made_up(rows) -> pd.DataFrame:
    """Errors of one setting: split, contact and error of each."""
    found = [("m", "k", i, split, contact, error) for i, (split, contact, error) in enumerate(rows)]
    return pd.DataFrame(found, columns=["model", "setting", "sample", "split", "contact", "rmse_of_peak"])


def test_whole_splits_are_drawn_and_contacts_of_each_which_weigh_by_their_samples():
    """Of two splits, one of which has contacts of 1 and the other of 3, a draw has none, one or two of the first."""
    uneven = made_up([(1, 0, 1.0), (1, 1, 4.0), (1, 1, 4.0), (1, 1, 4.0)])
    assert set(resampled(uneven, "rmse_of_peak").to_numpy().round(6).ravel()) == {1.0, 3.25, 4.0}
    same = made_up([(1, 0, 1.0), (1, 1, 1.0), (2, 2, 3.0), (2, 3, 3.0)])
    found = resampled(same, "rmse_of_peak").to_numpy().ravel()
    assert set(found.round(6)) == {1.0, 2.0, 3.0}
    assert np.mean(found == 2.0) == pytest.approx(0.5, abs=0.05)
    spread = made_up([(1, 0, 0.0), (1, 1, 2.0), (2, 2, 0.0), (2, 3, 2.0)])
    assert resampled(spread, "rmse_of_peak").to_numpy().std() == pytest.approx(0.5, rel=0.05)  # of four contacts


def test_reads_what_a_run_leaves_behind(trade_off, trade_off_folder):
    table, samples = trade_off
    found = read_errors(trade_off_folder / "data", table[table["scene"] == "own_large"])
    wanted = samples["own_large"].query("model != 'zero'")
    assert len(found) == len(wanted) == 9 * 36
    other = read_errors(trade_off_folder / "data", table[table["scene"] == "own_large"].assign(split=2))
    assert other.empty  # an earlier run may have left other splits behind
    both = found.merge(wanted, on=["model", "setting", "sample"])
    assert (both["contact_x"] == both["contact_y"]).all()
    np.testing.assert_allclose(both["rmse_of_peak_x"], both["rmse_of_peak_y"])


def tied(*rows):
    return pd.DataFrame(rows, columns=["rmse_of_peak", "online_median_s", "memory_mb"])


@pytest.mark.parametrize(
    ("rows", "by", "chosen"),
    [
        ([(0.1, 1, 1), (0.2, 0.1, 1)], BY_ERROR, 0),
        ([(0.1, 1, 1), (0.104, 0.1, 1)], BY_ERROR, 1),  # errors tied: the clearly faster
        ([(0.1, 1, 5), (0.104, 0.9, 1)], BY_ERROR, 1),  # times tied too: the smaller
        ([(0.1, 1, 1), (0.104, 0.9, 1.05)], BY_ERROR, 0),  # all tied: the first
        ([(0.0, 1, 1), (1e-9, 0.1, 1)], BY_ERROR, 1),  # both are all but exact
        ([(0.0, 1, 1), (1e-4, 0.1, 1)], BY_ERROR, 0),
    ],
)
def test_ties_are_broken_in_turn(rows, by, chosen):
    assert pick(tied(*rows), by).name == chosen


@pytest.mark.parametrize("seed", range(10))
def test_the_lasting_front_is_what_nobody_clearly_beats(seed):
    random = np.random.default_rng(seed)
    seconds, error = random.lognormal(0, 1, (2, 30))
    error[3], error[7], seconds[4] = np.nan, 1e-9, np.inf
    seconds[5], error[5] = seconds[6], error[6]
    for i, kept in enumerate(lasting(seconds, error)):
        beaten = any(
            (t <= TIED_TIMES * seconds[i] and e * EQUAL < error[i])
            or (e <= EQUAL * error[i] and t * TIED_TIMES < seconds[i])
            for t, e in zip(seconds, np.maximum(error, EXACT), strict=True)
        )
        assert kept == (np.isfinite(seconds[i] + error[i]) and not beaten)


def test_twins_both_last_and_the_first_stays():
    assert lasting([1.0, 1.1, 9.0], [1.0, 1.0, 2.0]).tolist() == [True, True, False]
    rows = tied((0.1, 1, 1), (0.104, 1.4, 1), (0.104, 1.6, 1), (0.2, 1, 1), (1e-12, 5, 1), (1e-9, 6, 1))
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
