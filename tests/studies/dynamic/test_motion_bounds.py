"""Bounds of motions: places are the unit, what failed is as wrong as can be, and a good estimate makes them sharp."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.conformal import CONSTANT, OWN
from palpate.studies.dynamic.elsewhere import MOTION_BOUNDS, MOTION_PLACES, motion_bounds

PLACES = 20


@pytest.fixture
def measured():
    """A model that knows its error to within 5 %, which differs tenfold between places, and one that says nothing."""
    random = np.random.default_rng(3)
    told = np.exp(random.uniform(0.0, np.log(10.0), PLACES))
    knows = pd.DataFrame({"contact": np.arange(PLACES), "model": "knows", "estimate_of_peak": told})
    knows["rmse_of_peak"] = 0.01 * told * random.uniform(0.95, 1.05, PLACES)
    table = pd.concat([knows, knows.assign(model="silent", estimate_of_peak=np.nan)])
    table = table.assign(scene="press", body="bar", setting="s", failures=0, estimate_s=0.1)
    return table.reindex(columns=MOTION_PLACES.columns)


def row(measured, model, estimate):
    found = motion_bounds([measured])
    assert found.columns.tolist() == MOTION_BOUNDS.columns
    return found.set_index(["model", "estimate"]).loc[model, estimate]


def test_what_a_model_knows_of_itself_makes_bounds_sharp_and_both_hold(measured):
    flat, own = row(measured, "knows", CONSTANT), row(measured, "knows", OWN)
    errors = measured.loc[measured["model"] == "knows", "rmse_of_peak"].sort_values()
    assert flat["bound_of_peak"] == pytest.approx(errors.iloc[18])  # of 21, one unknown, 19 are nine in ten
    assert own["sharpness"] < 1.12 < 1.5 < flat["sharpness"] and own["rank_correlation"] > 0.99
    for each in (flat, own):
        assert each["places"] == PLACES and 0.85 <= each["coverage"] <= 1.0
    assert own["estimate_s"] == 0.1 and flat["estimate_s"] == 0.0
    # a model that says nothing has the constant bound alone
    assert set(motion_bounds([measured]).set_index("model").loc[["silent"], "estimate"]) == {CONSTANT}


def test_a_motion_that_failed_is_as_wrong_as_can_be(measured):
    failed = measured.copy()
    failed.loc[(failed["model"] == "knows") & (failed["contact"] == 0), ["failures", "rmse_of_peak"]] = 1, np.nan
    once = row(failed, "knows", CONSTANT)
    assert once["failures"] == 1 and once["bound_of_peak"] >= row(measured, "knows", CONSTANT)["bound_of_peak"]
    failed.loc[(failed["model"] == "knows") & (failed["contact"] < 3), ["failures", "rmse_of_peak"]] = 1, np.nan
    assert np.isnan(row(failed, "knows", CONSTANT)["bound_of_peak"])


def test_places_without_a_reference_are_counted_and_a_few_places_give_no_bound(measured):
    told = measured.copy()
    told.loc[told["contact"] >= 8, ["model", "setting"]] = None
    hard = told[told["contact"] < 4].assign(setting="at hard places alone")
    assert "at hard places alone" not in set(motion_bounds([pd.concat([told, hard])])["setting"])
    few = row(told, "knows", CONSTANT)
    assert (few["places"], few["unresolved"]) == (8, 12)
    assert np.isnan(few["bound_of_peak"]) and np.isnan(few["coverage"])
