"""Draws of whole contacts."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.comparison import DRAWS, RANGE, read_errors, resampled
from palpate.errors import InputError


def of_test(errors):
    """The errors on test samples."""
    return errors[errors["side"] == "test"]


def test_draws_are_those_of_contacts_not_of_samples(trade_off):
    """The spread of a mean over 4 contacts is that of the contacts' means over the root of 4, whatever the forces."""
    _, samples = trade_off
    means = resampled(of_test(samples["liver_small"]), "rmse_of_peak")
    drawn = means.loc[("detail_correction", "samples=60")]
    assert drawn.shape == (DRAWS,)
    assert drawn.mean() == pytest.approx(0.004, rel=0.01)
    assert drawn.std() == pytest.approx(0.004 * np.std([0.5, 1.0, 1.5, 1.0]) / 2, rel=0.05)
    low, high = drawn.quantile(list(RANGE))
    assert 0.5 * 0.004 < low < 0.004 < high < 1.5 * 0.004


def test_all_settings_see_the_same_draws(trade_off):
    _, samples = trade_off
    means = resampled(of_test(samples["liver_small"]), "rmse_of_peak")
    few, many = means.loc[("detail_correction", "samples=10")], means.loc[("detail_correction", "samples=60")]
    assert np.allclose(few / many, 2.5)  # in every draw, though both spread
    there = means.loc[("pod_rbf", "modes=8")] / 0.00412
    assert np.allclose(there + many / 0.004, 2)  # what is hard for one is easy for the other


def made_up(rows) -> pd.DataFrame:
    """Errors of one setting: split, contact and error of each."""
    found = [("m", "k", i, split, contact, error) for i, (split, contact, error) in enumerate(rows)]
    return pd.DataFrame(found, columns=["model", "setting", "sample", "split", "contact", "rmse_of_peak"])


def test_uneven_contacts_weigh_by_their_samples():
    errors = made_up([(1, 0, 1.0), (1, 1, 4.0), (1, 1, 4.0), (1, 1, 4.0)])
    assert set(resampled(errors, "rmse_of_peak").to_numpy().round(6).ravel()) == {1.0, 3.25, 4.0}


def test_whole_splits_are_drawn_and_contacts_of_each():
    """Of two splits, one of which has contacts of 1 and the other of 3, a draw has none, one or two of the first."""
    same = made_up([(1, 0, 1.0), (1, 1, 1.0), (2, 2, 3.0), (2, 3, 3.0)])
    found = resampled(same, "rmse_of_peak").to_numpy().ravel()
    assert set(found.round(6)) == {1.0, 2.0, 3.0}
    assert np.mean(found == 2.0) == pytest.approx(0.5, abs=0.05)
    spread = made_up([(1, 0, 0.0), (1, 1, 2.0), (2, 2, 0.0), (2, 3, 2.0)])
    assert resampled(spread, "rmse_of_peak").to_numpy().std() == pytest.approx(0.5, rel=0.05)  # of four contacts


def test_what_failed_on_a_sample_has_no_draws(trade_off):
    _, samples = trade_off
    assert ("springs", "iterations=1") not in resampled(of_test(samples["liver_small"]), "rmse_of_peak").index


def test_reads_what_a_run_leaves_behind(trade_off, trade_off_folder):
    table, samples = trade_off
    found = read_errors(trade_off_folder / "data", table[table["scene"] == "own_large"])
    wanted = samples["own_large"].query("model not in ['truth', 'zero']")
    assert len(found) == len(wanted) == 8 * 24
    other = read_errors(trade_off_folder / "data", table[table["scene"] == "own_large"].assign(split=2))
    assert other.empty  # an earlier run may have left other splits behind
    both = found.merge(wanted, on=["model", "setting", "sample"])
    assert (both["contact_x"] == both["contact_y"]).all()
    np.testing.assert_allclose(both["rmse_of_peak_x"], both["rmse_of_peak_y"])


def test_what_is_missing_is_named(trade_off, trade_off_folder):
    table, _ = trade_off
    liver = table[table["scene"] == "liver_small"]
    place = trade_off_folder / "data/liver/small"
    (place / "tradeoff/1/detail_correction_samples.csv").write_text("model,setting,sample\n")
    with pytest.raises(
        InputError, match=r"detail_correction_samples\.csv lacks the column\(s\) split, side, contact, rmse"
    ):
        read_errors(trade_off_folder / "data", liver)
    (place / "tradeoff/1/detail_correction_samples.csv").unlink()
    with pytest.raises(InputError, match=r"^liver_small: the sample errors of detail_correction are missing"):
        read_errors(trade_off_folder / "data", liver)
