"""Advice by the error of an instrument's force follows from the table of touches."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.advice import choice, touches
from palpate.benchmark.choosing import BOUND, NONE, Limit
from palpate.benchmark.ranking import OWN_ERROR, TRUTH

COLUMNS = [
    "scene", "force_error", "rmse_of_peak", "patch_rms_of_peak", "online_p95_s", "preparation_s", "offline_s",
    "samples",
]  # fmt: skip


def rows(*models) -> pd.DataFrame:
    """Rows of a table: name, 95th percentile of the error of the force, time [s], failures."""
    found = []
    for name, error, time, failures in ((TRUTH, 0.01, np.nan, 0), *models):
        row = dict.fromkeys(COLUMNS, 0.0) | {"scene": "liver_sphere_8mm", "model": name, "setting": OWN_ERROR}
        row |= {"force_error_p95": error, "force_error_size": error / 2, "force_error_bound": np.nan}
        found.append(row | {"online_median_s": time, "online_max_s": time, "memory_mb": 1.0, "failures": failures})
    return pd.DataFrame(found)


SPREAD = rows(("fast", 0.3, 1e-4, 0), ("fine", 0.02, 1e-2, 0), ("lost", 0.0, 1e-5, 1), ("mute", np.nan, 1e-5, 0))


@pytest.mark.parametrize(("budget", "best"), [(1.0, "fast"), (11.0, "fast"), (16.7, "fine"), (np.nan, "fine")])
def test_the_nearest_that_answers_in_time_is_taken(budget, best):
    found = choice(touches(SPREAD), Limit(budget))
    assert found["model"] == best and found["reference_error"] == 0.01
    assert found["limit"] == pytest.approx({"fast": 0.31, "fine": 0.03}[best])
    assert found["basis"] != BOUND and np.isnan(found["bound_of_peak"])


@pytest.mark.parametrize(("most", "best"), [(0.5, "fast"), (0.1, "fine"), (0.03, "fine")])
def test_the_fastest_that_is_near_enough_is_taken(most, best):
    assert choice(touches(SPREAD), Limit(max_error=most))["model"] == best


def test_where_nothing_keeps_the_limit_the_nearest_is_named():
    late, wrong = (choice(touches(SPREAD), limit) for limit in (Limit(0.1), Limit(max_error=0.025)))
    assert late["model"] == wrong["model"] == NONE
    assert late["nearest"] == "fast" and wrong["nearest"] == "fine"
    silent = choice(touches(rows(("mute", np.nan, 1e-5, 0))), Limit(1.0))
    assert silent["model"] == NONE and np.isnan(silent["nearest_s"]) and silent["why"] == "no model gives a force"


def test_a_bound_takes_the_place_of_a_percentile():
    known = SPREAD.assign(force_error_bound=[np.nan, 0.02, 0.5, 0.0, np.nan])
    found = choice(touches(known), Limit(100.0))
    assert found["model"] == "fast" and found["limit"] == found["bound_of_peak"] == 0.02
