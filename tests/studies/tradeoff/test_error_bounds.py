"""The table of bounds: every estimate is tried, contacts are the unit, and what other bodies say is counted."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.conformal import CONSTANT, OWN
from palpate.benchmark.ranking import TRAINING
from palpate.studies.tradeoff.error_bounds import ERROR_BOUNDS, SAMPLES, Scene, error_bounds
from palpate.studies.tradeoff.error_estimates import COARSER, EVERY, RESIDUAL

CONTACTS = 12


def scene(body, worse=1.0, failed=False):
    """A scene with a fast and a slow model; what is turned knows the errors of the fast one, up to a factor of two."""
    random = np.random.default_rng(len(body))
    hard = np.repeat(np.exp(random.standard_normal(CONTACTS)), 2)
    contact = np.repeat(np.arange(CONTACTS), 2)
    place = {"split": 1, "side": "test", "sample": np.arange(2 * CONTACTS), "contact": contact}
    rows = []
    for model, error in (("fast", 0.02 * worse * hard), ("slow", np.full(2 * CONTACTS, 0.003))):
        told = 0.5 * error if model == "slow" else np.nan
        found = {"rmse_of_peak": error, "patch_rms_of_peak": 2 * error, "estimated_of_peak": told}
        found |= {"coarser_rmse_of_peak": 0.9 * error, "coarser_patch_rms_of_peak": np.nan}
        rows.append(pd.DataFrame({"model": model, "setting": "default"} | place | found))
    errors = pd.concat(rows)[SAMPLES]
    if failed:
        errors.loc[(errors["model"] == "slow") & (errors["sample"] == 3), "rmse_of_peak"] = np.nan
    labels = {"scene": f"{body}_small", "body": body, "regime": "small", "split": 1, "failures": 0}
    settings = [
        labels | {"model": model, "setting": "default", "online_median_s": seconds}
        | {f"validation_{name}": error for name in ("rmse_of_peak", "patch_rms_of_peak")}
        for model, seconds, error in (("fast", 1e-4, 0.02), ("slow", 1.0, 0.003))
    ]  # fmt: skip
    told = pd.DataFrame({"model": EVERY, "setting": "", "estimate": "turned"} | place | {"rms": hard, "patch": hard})
    told["seconds"] = 1e-4
    seen = told.assign(model="fast", setting="default", estimate=RESIDUAL, rms=hard**0.5)
    timed = told.iloc[:3].assign(estimate=COARSER, rms=np.nan, patch=np.nan, seconds=0.02)
    return Scene(pd.DataFrame(settings), errors, pd.concat([told, seen, timed]))


@pytest.fixture(scope="module")
def table():
    return error_bounds([scene("cylinder"), scene("liver", worse=3.0)])


def row(table, **asked):
    for column, value in asked.items():
        table = table[table[column] == value]
    (found,) = table.itertuples()
    return found


def test_every_estimate_has_a_row_and_the_own_one_is_of_models_that_have_it(table):
    assert table.columns.tolist() == ERROR_BOUNDS.columns
    fast = table[(table["model"] == "fast") & (table["scene"] == "liver_small") & (table["error"] == "rms")]
    assert set(fast["estimate"]) == {CONSTANT, "turned", RESIDUAL, COARSER}
    assert set(table[table["model"] == "slow"]["estimate"]) == {CONSTANT, "turned", OWN, COARSER}
    assert (table["contacts"] == CONTACTS).all() and (table["samples"] == 2 * CONTACTS).all()


def test_a_second_answer_tells_of_every_model_and_of_each_kind_of_error_by_itself(table):
    """Its time is its own, and where the patch was not compared there is no such bound of errors there."""
    second = table[table["estimate"] == COARSER]
    assert set(second["model"]) == {"fast", "slow"} and set(second["error"]) == {"rms"}
    assert (second["estimate_s"] == 0.02).all() and second["bound_factor"].to_numpy() == pytest.approx(1 / 0.9)
    assert second["sharpness"].to_numpy() == pytest.approx(1.0)


def test_an_estimate_that_ranks_is_sharp_and_one_that_does_not_is_loose(table):
    asked = {"scene": "liver_small", "model": "fast", "error": "rms"}
    turned, flat = (row(table, estimate=name, **asked) for name in ("turned", CONSTANT))
    assert turned.rank_correlation == pytest.approx(1.0) and np.isnan(flat.rank_correlation)
    assert turned.sharpness == pytest.approx(1.0) and turned.bound_factor == pytest.approx(0.06)
    assert flat.sharpness > 1.5 and flat.bound_of_peak > turned.bound_of_peak
    assert row(table, scene="liver_small", model="slow", error="patch", estimate=OWN).bound_factor == pytest.approx(4.0)


def test_the_truths_own_error_is_in_every_bound():
    """Of an own error of 1 % a constant bound is 1 % larger, and errors are shown without it."""
    known = scene("liver")
    mine = known.errors[known.errors["model"] == "slow"]
    own = mine.assign(model="truth", setting="own error", rmse_of_peak=0.01, patch_rms_of_peak=0.02)
    tables = error_bounds([known]), error_bounds([known._replace(errors=pd.concat([known.errors, own]))])
    asked = {"model": "slow", "error": "rms", "estimate": CONSTANT}
    without, told = (row(table, **asked) for table in tables)
    assert told.bound_of_peak == pytest.approx(without.bound_of_peak + 0.01) and told.own_of_peak == pytest.approx(0.01)
    assert told.error_of_peak == pytest.approx(without.error_of_peak) and np.isnan(without.own_of_peak)
    there = own[own["sample"] > 0]  # of one press it is not known, and the largest that is stands for it
    there = error_bounds([known._replace(errors=pd.concat([known.errors, there]))])
    assert row(there, **asked).bound_of_peak == pytest.approx(told.bound_of_peak)


def test_bounds_of_another_body_need_not_hold(table):
    """The liver errs three times as much, which a factor found on the cylinder does not know."""
    asked = {"model": "fast", "error": "rms", "estimate": "turned"}
    assert row(table, scene="liver_small", **asked).coverage_elsewhere == 0.0
    assert row(table, scene="cylinder_small", **asked).coverage_elsewhere == 1.0
    alone = error_bounds([scene("liver")])
    assert alone["coverage_elsewhere"].isna().all()


def test_contacts_of_several_bodies_are_different_ones():
    """Six contacts of each of two bodies have the same numbers, and are enough for a bound together."""
    few = []
    for body in ("cylinder", "liver", "kidney"):
        whole = scene(body)
        few.append(whole._replace(errors=whole.errors[whole.errors["contact"] < 6]))
    table = error_bounds(few)
    assert table["bound_factor"].isna().all() and table["coverage_elsewhere"].notna().all()


def test_what_did_not_answer_everything_has_no_bound():
    assert set(error_bounds([scene("liver", failed=True)]).query("error == 'rms'")["model"]) == {"fast"}


def test_what_learns_nothing_is_known_at_more_contacts():
    """Answers at training contacts count for the settings that gave them, and no others have to."""
    known = scene("liver")
    more = known.errors[known.errors["model"] == "fast"].iloc[:4]
    more = more.assign(side=TRAINING, sample=100 + np.arange(4), contact=100 + np.arange(4))
    more.loc[more.index[3], ["rmse_of_peak", "patch_rms_of_peak"]] = np.nan  # a failure there is left out
    given = known.estimates[known.estimates["model"] == EVERY].iloc[:4]
    given = given.assign(sample=more["sample"].to_numpy(), contact=more["contact"].to_numpy())
    whole = known._replace(errors=pd.concat([known.errors, more]), estimates=pd.concat([known.estimates, given]))
    table = error_bounds([whole])
    fast, slow = (row(table, model=name, error="rms", estimate="turned") for name in ("fast", "slow"))
    assert (fast.contacts, fast.samples) == (CONTACTS + 3, 2 * CONTACTS + 3)
    assert (slow.contacts, slow.samples) == (CONTACTS, 2 * CONTACTS)
    known = {CONSTANT, "turned", COARSER}  # what the residual says of training contacts nobody has looked at
    assert set(table[(table["model"] == "fast") & (table["error"] == "rms")]["estimate"]) == known
