"""Advice for scenes that move, and for loads that nothing was prepared for, follows from errors and times."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.advice import advise_motion, choice, operator_error, other_loads
from palpate.benchmark.advice import motions as moving
from palpate.benchmark.choosing import NONE, Limit
from palpate.report.advice_words import lines, say
from palpate.studies.tradeoff.general_loads import ANY_LOAD


@pytest.fixture
def motions():
    """Error, seconds for a second of motion, p95 of a step [ms], failures."""
    told = [
        ("fem_fine", "step_s=0.02", 0.001, 20.0, 450.0, 0),
        ("fem_coarse", "step_s=0.02", 0.05, 0.3, 9.0, 0),
        ("springs", "step_s=0.001", 0.02, 0.1, 0.15, 0),
        ("springs", "step_s=0.002", 0.0201, 0.05, 0.15, 0),  # on a par, and twice as fast
        ("shape_matching", "step_s=0.01", 0.01, 0.9, 0.2, 0),  # hardly keeps up
        ("own", "step_s=0.1", np.nan, np.nan, np.nan, 1),
    ]
    names = ["model", "setting", "rmse_of_peak", "real_time_factor", "step_p95_ms", "failures"]
    table = pd.DataFrame(told, columns=names)
    return table.assign(
        scene="press",
        body="bar",
        varied="step",
        reference="fem_fine",
        reference_level=1,
        reference_change=1e-4,
        reference_error=np.nan,
        resolved_s=1.0,
        duration_s=1.0,
        parted="",
        p95_of_peak=2 * table["rmse_of_peak"],
        step_max_ms=3 * table["step_p95_ms"],
    )


def test_least_wrong_of_what_keeps_up_within_the_budget(motions):
    found = advise_motion(motions, budgets_ms=[0.15, 1, 16.7]).set_index("budget_ms")
    assert found.loc[0.15, "model"] == "none" and "springs step_s=0.001, takes 1.25 times" in found.loc[0.15, "why"]
    near = found.loc[0.15, ["nearest", "nearest_error", "nearest_s"]].tolist()
    assert near == ["springs", pytest.approx(0.02), pytest.approx(1.5e-4)]
    row = found.loc[1]
    assert (row["model"], row["setting"]) == ("springs", "step_s=0.002")
    assert row["online_p95_s"] == pytest.approx(1.5e-4) and row["margin"] == pytest.approx(1 - 0.15)
    assert pd.isna(row["rival"])
    row = found.loc[16.7]
    assert (row["model"], row["rival"]) == ("springs", "fem_coarse")
    assert row["factor"] == pytest.approx(0.05 / 0.0201)
    assert found["online_max_s"].tolist()[1:] == pytest.approx([4.5e-4, 4.5e-4])


def test_a_budget_of_a_step_takes_what_a_larger_one_lets_be_more_accurate(motions):
    """No larger error is taken for more time; each step has its 95th percentile below, and its largest told."""
    table = motions.assign(real_time_factor=0.5)  # all keep up
    found = advise_motion(table, budgets_ms=[0.1, 1, 8, 16.7, 1000])
    assert found["model"].tolist() == ["none", "shape_matching", "shape_matching", "shape_matching", "fem_fine"]
    taken = found[found["model"] != "none"]
    assert (1e3 * taken["online_p95_s"] <= 0.8 * taken["budget_ms"]).all()
    assert taken["rmse_of_peak"].is_monotonic_decreasing


def presses(own):
    """Rows of accuracy_vs_time.csv in which the standard's mesh is ``own`` wrong, another level more."""
    row = {"scene": "bar_small", "body": "bar", "model": "fem_p1", "patch_rms_of_peak": 2 * own}
    told = [("level=1, start=rest, tolerance=0.001", 3.0), ("level=1, start=rest, tolerance=1e-08", 1.0)]
    return pd.DataFrame([row | {"setting": s, "rmse_of_peak": f * own} for s, f in [*told, ("level=0, start=rest", 9)]])


def test_fastest_of_what_is_accurate_enough_the_standards_own_error_added(motions):
    """The standard is 0.2 % wrong by its mesh, and 0.01 % by its step."""
    found = advise_motion(motions, max_errors=[0.03, 0.004, 0.003], pressed=presses(0.002))
    assert list(found["model"]) == ["springs", "fem_fine", "none"]
    assert found["reference_error"].to_numpy() == pytest.approx(0.0021)
    assert found["margin"].iloc[1] == pytest.approx(1 - 0.0031 / 0.004)
    assert (found["nearest"].iloc[2], found["nearest_bound"].iloc[2]) == ("fem_fine", pytest.approx(0.0031))
    assert "which is 0.21 % wrong itself" in found["why"].iloc[2]


def test_no_error_is_promised_below_that_of_the_standard_or_where_nobody_knows_it(motions):
    assert advise_motion(motions, max_errors=[0.05], pressed=presses(0.08))["model"].tolist() == ["none"]
    unknown = advise_motion(motions, [16.7], [0.05])
    assert unknown["model"].tolist() == ["springs", "none"] and unknown["reference_error"].isna().all()
    assert "is not known" in unknown["why"].iloc[1] and unknown["nearest"].iloc[1] == "fem_fine"
    assert unknown["nearest_error"].iloc[1] == pytest.approx(0.001) and np.isnan(unknown["nearest_bound"].iloc[1])


def test_an_error_and_a_speed_at_once(motions):
    """Springs have 2 %, 2.2 % with the truth's own, at 20 times life; shape matching 1.2 %, and hardly keeps up."""
    judged = motions.assign(reference="fem_p2", reference_error=0.002, resolved_s=0.4, duration_s=0.8)

    def asked(error, speed):
        return choice(moving(judged), Limit(max_error=error, speed=speed))

    row = asked(0.03, 1)
    assert (row["model"], row["setting"]) == ("springs", "step_s=0.002") and row["over"] == "the first 0.4 of 0.8 s"
    assert row["margin"] == pytest.approx(1 - 0.0221 / 0.03) and row["times_life"] == pytest.approx(20.0)
    wrong, slow = asked(0.015, 1), asked(0.03, 100)
    assert wrong["model"] == slow["model"] == "none" and wrong["nearest"] == "springs"
    assert wrong["nearest_bound"] == pytest.approx(0.022)


def test_a_truth_is_added_as_it_is_and_no_limit_below_it_is_met(motions):
    """Whatever presses of linear elements show."""
    judged = motions.assign(reference="fem_p2", reference_error=0.002)
    found = advise_motion(judged, max_errors=[0.03, 0.0029, 0.0019], pressed=presses(0.08))
    assert list(found["model"]) == ["springs", "none", "none"] and (found["reference_error"] == 0.002).all()
    assert found["margin"].iloc[0] == pytest.approx(1 - 0.0221 / 0.03)
    assert found["why"].str.startswith("errors are known to 0.2 % only").tolist() == [False, False, True]


def test_a_limit_is_kept_by_the_bound_elsewhere_where_there_is_one(motions):
    """Springs have 2 % on their own path and 4 % elsewhere, shape matching was asked nowhere else."""
    judged = motions.assign(reference="fem_p2", reference_error=0.002)
    row = {"model": "springs", "setting": "step_s=0.002", "estimate": "constant", "places": 10, "failures": 0}
    row |= {"bound_of_peak": 0.04, "coverage": 0.9}
    bounds = pd.DataFrame([row, row | {"model": "fem_coarse", "setting": "step_s=0.02", "bound_of_peak": 0.07}])
    found = advise_motion(judged, max_errors=[0.1, 0.05, 0.03], bounds=bounds)
    assert found["setting"].fillna("").tolist() == ["step_s=0.002", "step_s=0.002", ""]
    assert found["margin"].tolist()[:2] == pytest.approx([0.6, 0.2])
    assert (found["nearest"].iloc[2], found["nearest_bound"].iloc[2]) == ("springs", 0.04)
    both = choice(moving(judged, bounds), Limit(max_error=0.05, speed=1))
    assert (both["model"], both["bound_of_peak"]) == ("springs", 0.04)
    alone = advise_motion(judged, max_errors=[0.03]).iloc[0]
    assert alone["model"] == "springs" and np.isnan(alone["bound_of_peak"])
    assert "on this path only" in alone["bound_on"]


def test_what_failed_and_modes_for_another_place_are_measured_and_not_advised(motions):
    found = advise_motion(motions.assign(failures=1), [1], [0.1])
    assert list(found["model"]) == ["none", "none"] and set(found["why"]) == {"no model got through the scene"}
    found = advise_motion(motions.assign(varied=np.where(motions["model"] == "springs", "place", "step")), [16.7])
    assert found["model"].tolist() == ["fem_coarse"]


def rows(*told, asked=12):
    """Rows of any_load.csv of new places: model, error, time [ms], and how many of the loads are doubted or failed."""
    found = []
    for model, error, time, doubted, failures in told:
        row = {"scene": "liver_large", "model": model, "setting": "default", "kind": "never prepared", "samples": asked}
        row |= {"refused": 0, "doubted": doubted, "failures": failures, "contacts": asked - doubted - failures}
        row |= {"rmse_of_peak": error, "rmse_of_peak_most": 1.5 * error, "online_median_s": 1e-3 * time}
        row |= {"online_p95_s": 1.1e-3 * time, "online_max_s": 1.3e-3 * time, "preparation_s": 0.0}
        found.append(row | {"offline_s": 2.0, "memory_mb": 5.0})
    return pd.DataFrame(found).reindex(columns=ANY_LOAD.columns)


def new_places(table, own=np.nan, **limit):
    """What is advised for places that were never prepared."""
    return choice(other_loads(table, "never prepared", own=own), Limit(**limit))


EXACT, COARSE, LOST = ("modes", 0.004, 1.0, 3, 0), ("coarse", 0.05, 2.0, 0, 0), ("lost", 0.001, 0.1, 0, 1)


def test_a_model_that_doubts_is_advised_where_nothing_answers_all():
    found = new_places(rows(EXACT, COARSE, LOST), max_error=0.01)
    assert (found.model, found.doubted, found.samples, found.most) == ("modes", 3, 12, pytest.approx(0.006))
    assert "doubts 3 of 12 loads (25 %)" in lines(found) and "doubts 3 of 12 loads" in say("taken", found)
    often = new_places(rows(("often", 0.001, 0.1, 3, 0), EXACT), max_error=0.01)
    assert often.model == "often"
    more = new_places(rows(("often", 0.001, 0.1, 3, 0), (*EXACT[:3], 2, 0)), max_error=0.01)
    assert more.model == "modes"  # of those that doubt the one of fewest doubts


def test_a_model_that_answers_all_comes_first_and_what_was_passed_over_is_named():
    found = new_places(rows(EXACT, COARSE, LOST), budget_ms=10)
    assert (found.model, found.doubted, found.bound_of_peak) == ("coarse", 0, pytest.approx(0.075))
    assert "doubts" not in lines(found)


def test_what_failed_without_saying_so_or_doubts_all_is_never_advised():
    never = ("never", float("nan"), 0.1, 12, 0)
    found = new_places(rows(LOST, never), max_error=0.5)
    assert found.model == NONE and found.why.startswith("no setting has answered all loads")
    assert lines(found).count("\n") == 1 and say("taken", found).startswith("none: ")
    least = new_places(rows(EXACT), max_error=1e-6)
    assert least.model == NONE and "1.3 ms for the slowest load; it doubts 3 of 12 loads" in lines(least)


def test_below_nine_contacts_no_error_is_promised_and_the_nearest_is_named():
    few = rows(EXACT, COARSE, asked=8)
    found = new_places(few, max_error=0.5)
    assert (found.model, found.nearest, found.contacts) == (NONE, "modes", 5)
    assert found.nearest_error == pytest.approx(0.004) and np.isnan(found.nearest_bound)
    timely = new_places(few, budget_ms=10)
    assert timely.model == "coarse" and np.isnan(timely.bound_of_peak)
    nine = new_places(rows(COARSE, asked=9), max_error=0.5)
    assert nine.model == "coarse" and nine.bound_of_peak == pytest.approx(0.075)


def test_the_operators_own_error_is_a_part_of_the_bound():
    found = [new_places(rows(COARSE), own, max_error=0.08) for own in (0.004, 0.006)]
    assert [each.model for each in found] == ["coarse", NONE]
    assert (found[0].bound_of_peak, found[1].nearest_bound) == pytest.approx((0.079, 0.081))
    assert found[1].nearest == "coarse" and found[1].nearest_error == pytest.approx(0.05)


def test_a_budget_is_met_by_the_slowest_load():
    found = [new_places(rows(COARSE), budget_ms=budget) for budget in (2.6 / 0.79, 2.6 / 0.81)]
    assert [each.model for each in found] == ["coarse", NONE] and found[1].nearest == "coarse"


def test_the_operator_errs_by_its_distance_from_the_truth_and_by_the_truths_own_error():
    told = [
        ("fem_p2", "level=1, start=rest, tolerance=1e-08", 0.02),
        ("fem_p2", "level=1, start=rest, tolerance=0.001", 0.03),
        ("fem_p2", "level=0, start=rest, tolerance=1e-08", 0.06),
        ("fem_p2", "level=2, start=frame, iterations=1", 0.01),
        ("truth", "own error", 0.004),
    ]
    table = pd.DataFrame(told, columns=["model", "setting", "rmse_of_peak"]).assign(failures=0)
    table["validation_rmse_of_peak"] = 0.5 * table["rmse_of_peak"]
    assert operator_error(table, "rmse_of_peak") == pytest.approx(0.024)
    assert np.isnan(operator_error(table[table["model"] == "truth"], "rmse_of_peak"))
    assert np.isnan(operator_error(table[table["model"] == "fem_p2"], "rmse_of_peak"))
