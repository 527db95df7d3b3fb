"""Draws of whole contacts."""

import numpy as np
import pandas as pd
import pytest

from palpate.errors import InputError
from palpate.evaluation.tradeoff.bootstrap import DRAWS, RANGE, read_errors, resampled


def test_draws_are_those_of_contacts_not_of_samples(trade_off):
    """The spread of a mean over 4 contacts is that of the contacts' means over the root of 4, whatever the forces."""
    _, samples = trade_off
    means = resampled(samples["liver_small"])
    drawn = means.loc[("detail_correction", "samples=60")]
    assert drawn.shape == (DRAWS,)
    assert drawn.mean() == pytest.approx(0.004, rel=0.01)
    assert drawn.std() == pytest.approx(0.004 * np.std([0.5, 1.0, 1.5, 1.0]) / 2, rel=0.05)
    low, high = drawn.quantile(list(RANGE))
    assert 0.5 * 0.004 < low < 0.004 < high < 1.5 * 0.004


def test_all_settings_see_the_same_draws(trade_off):
    _, samples = trade_off
    means = resampled(samples["liver_small"])
    few, many = means.loc[("detail_correction", "samples=10")], means.loc[("detail_correction", "samples=60")]
    assert np.allclose(few / many, 2.5)  # in every draw, though both spread
    there = means.loc[("pod_rbf", "modes=8")] / 0.00412
    assert np.allclose(there + many / 0.004, 2)  # what is hard for one is easy for the other


def test_uneven_contacts_weigh_by_their_samples():
    errors = pd.DataFrame(
        [("m", "k", i, contact, error) for i, (contact, error) in enumerate([(0, 1.0), (1, 4.0), (1, 4.0), (1, 4.0)])],
        columns=["model", "setting", "sample", "contact", "rmse_of_peak"],
    )
    assert set(resampled(errors).to_numpy().round(6).ravel()) == {1.0, 3.25, 4.0}


def test_what_failed_on_a_sample_has_no_draws(trade_off):
    _, samples = trade_off
    assert ("springs", "iterations=1") not in resampled(samples["liver_small"]).index


def test_reads_what_a_run_leaves_behind(trade_off, trade_off_folder):
    table, samples = trade_off
    found = read_errors(trade_off_folder / "data", table[table["scene"] == "own_large"])
    wanted = samples["own_large"].query("model != 'reference'")
    assert len(found) == len(wanted)
    both = found.merge(wanted, on=["model", "setting", "sample"])
    assert (both["contact_x"] == both["contact_y"]).all()
    np.testing.assert_allclose(both["rmse_of_peak_x"], both["rmse_of_peak_y"])


def test_what_is_missing_is_named(trade_off, trade_off_folder):
    table, _ = trade_off
    liver = table[table["scene"] == "liver_small"]
    place = trade_off_folder / "data/liver/small"
    (place / "tradeoff/detail_correction_samples.csv").write_text("model,setting,sample\n")
    with pytest.raises(InputError, match=r"detail_correction_samples\.csv lacks the column\(s\) rmse_of_peak"):
        read_errors(trade_off_folder / "data", liver)
    (place / "tradeoff/detail_correction_samples.csv").unlink()
    with pytest.raises(InputError, match=r"^liver_small: the sample errors of detail_correction are missing"):
        read_errors(trade_off_folder / "data", liver)
    (place / "samples.csv").unlink()
    with pytest.raises(InputError, match=r"samples\.csv is missing; type make"):
        read_errors(trade_off_folder / "data", liver[liver["model"] != "detail_correction"])
