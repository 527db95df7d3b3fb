"""Errors over the steps of a press are drawn for every press and axis."""

import numpy as np
import pytest

from palpate.report import tables
from palpate.studies.springs import figures


def test_a_band_is_the_range_of_seeds_and_a_run_that_ended_keeps_its_best(spring_results):
    found = tables.where(spring_results["spring_history"], method="genetic", volume_force=False)
    curves = figures.best_so_far(found, "seconds", np.array([0.5, 1.0, 11.5, 99.0]))
    assert np.isnan(curves[:, 0]).all()
    assert curves[:, 1] == pytest.approx(np.array([0.56, 0.566, 0.572]))
    assert curves[:, 2] == pytest.approx(np.array([0.06, 0.066, 0.072]) + 0.25)
    assert curves[:, 3] == pytest.approx(np.array([0.06, 0.066, 0.072]))
