"""Words about advice name what the tables have: model, error, bound, time, and what was passed over."""

import re

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.advice import advise
from palpate.benchmark.advice_other_loads import advise_motion
from palpate.report import tables
from palpate.report.advice_words import (
    SAME,
    advice_list,
    behind,
    bounded,
    by_limit,
    lines,
    moved_cell,
    nearest,
    next_best,
    pace,
)


@pytest.fixture
def liver(advised_tables):
    return tables.where(advised_tables[1], scene="liver_small")


@pytest.fixture
def pressed(trade_off):
    settings, errors = trade_off
    return settings[settings["scene"] == "liver_small"], errors["liver_small"]


@pytest.fixture
def motions(dynamic_table):
    table = dynamic_table[dynamic_table["scene"] == "liver_press"].replace({"springs": "moving_modes"})
    table = table.replace({"setting": {"step_s=0.002": "step_s=0.07", "step_s=0.001": "step_s=0.035"}})
    return table.assign(
        body="liver",
        estimate_of_peak=0.03,
        ms_per_step=1.0,
        step_p95_ms=2.0,
        step_max_ms=3.0,
        p95_of_peak=0.06,
        offline_s=0.5,
    )


@pytest.fixture
def presses():
    """The standard's mesh is 0.4 % wrong in presses."""
    row = {"scene": "liver_small", "body": "liver", "model": "fem_p1", "rmse_of_peak": 0.004, "patch_rms_of_peak": 0.01}
    return pd.DataFrame([row | {"setting": f"level={level}, start=rest, tolerance=1e-08"} for level in range(3)])


@pytest.fixture
def bounds():
    row = {"scene": "liver_press", "model": "moving_modes", "setting": "step_s=0.035", "estimate": "constant"}
    row |= {"places": 12, "failures": 0, "bound_of_peak": 0.07, "coverage": 0.9}
    return pd.DataFrame([row, row | {"setting": "step_s=0.07", "bound_of_peak": np.nan, "failures": 3}])


def test_lines_name_model_error_bound_time_and_what_is_left(liver):
    none, first, second = (lines(liver.iloc[i]) for i in range(3))
    head, near, why = none.splitlines()
    assert head == "liver_small, within 0.01 ms: none" and near.startswith("  nearest   linear fine FEM: nine answers")
    assert "in 12 µs for the slowest press" in near
    assert why.startswith("  because   the fastest setting, linear_fem, takes 0.012")
    assert first.startswith(
        "liver_small, within 1 ms: linear_fem\n  error     5 % of the peak displacement on average ("
    )
    assert "  margin    99 % of the allowed time is left" in first and "has 3.91 times the bound" in first
    assert "error     0.41 % of" in second and "6 ms for the slowest press" in second
    assert "the truth is known to 0.15 % only, so that" in lines(liver.iloc[5])
    assert "\n  before    3 s of preparation, 50 MB\n" in first
    said = "nine answers in ten at other contacts are wrong by less than 7.7 %, by 12 contacts, 36 presses held out"
    assert f"\n  bound     {said}\n" in first
    row = liver.iloc[1].copy()
    row["bound_of_peak"], row["contacts"], row["presses"] = np.nan, 8, 24
    assert "\n  bound     none, as 8 contacts, 24 presses are too few\n" in lines(row)


def test_answers_to_presses_without_a_truth_are_counted_where_there_are_some(pressed):
    settings, errors = pressed
    row = advise(settings, errors, [16.7], kinds=["rms"]).iloc[0]
    assert "without a truth" not in lines(row) and "without a truth" not in advice_list(row.to_frame().T)
    given = settings.assign(rejected=4, rejected_answered=np.where(settings["model"] == "pod_rbf", 3, 0))
    row = advise(given, errors, [16.7], kinds=["rms"]).iloc[0]
    assert "\n  rejected  3 of 4 presses without a truth" in lines(row)
    assert "; 3 of 4 presses without a truth" in advice_list(row.to_frame().T)


def test_where_nothing_is_sure_the_nearest_is_named_with_its_risk(pressed):
    row = advise(*pressed, [], [0.0021], kinds=["rms"]).iloc[0]
    said = "nine answers in ten are below 0.23 % (12 contacts), in 500 ms for the slowest press; 25 % of its answers "
    assert nearest(row).replace("\u00a0", " ").endswith(f"{said}are above 0.21 %")
    row["nearest_bound"] = np.nan
    assert " % on average, the truth's own error added (12 contacts, 36 presses: too few for" in lines(row)
    assert "\n  nearest   " in lines(row) and "; nearest " in advice_list(row.to_frame().T)


def test_an_error_above_the_limit_comes_first(pressed):
    row = advise(*pressed, [], [0.08], kinds=["rms"]).iloc[0].copy()
    assert "larger than asked" not in lines(row)
    row["rmse_of_peak"], row["margin"] = 0.09, -24.0
    printed = lines(row).splitlines()
    assert printed[1] == "  beware    on the test contacts its error is larger than asked, 9 %"
    assert "  margin    nothing of the allowed error is left" in printed
    assert advice_list(row.to_frame().T).splitlines()[1].endswith("larger than asked, 9 %)")


def test_the_next_best_model_is_compared(pressed):
    row = advise(*pressed, [1], kinds=["rms"]).iloc[0].copy()
    assert next_best(row) == "the next best model, shape matching, has 3.9 times the bound"
    row["factor"] = 1.02
    assert behind(row) == "is as accurate"


def test_both_kinds_of_error_are_named_and_the_list_is_of_one(pressed):
    advice = advise(*pressed, [16.7], [0.07])
    surface, patch = (lines(tables.where(advice, error=kind).iloc[0]) for kind in ("rms", "patch"))
    assert "at the patch 0.62 %" in surface and "over the whole surface 0.41 %" in patch
    surface, patch = advice_list(advice).splitlines(), advice_list(advice, "patch").splitlines()
    assert surface[0].endswith("of the peak displacement):") and patch[0].endswith("at the patch):")
    assert "POD + RBF (modes=8): 0.41 % (nine in ten below 0.69 %" in surface[1] and len(surface) == len(patch) == 3
    assert "POD + RBF (modes=8): 0.62 % (nine in ten below 1 %" in patch[1]


def test_a_table_repeats_no_cell_and_counts_none_as_one():
    taken = {"a": ["fem", "fem", "springs", "fem"], "b": ["none", "none", "none", "fem"]}
    limits = [{"budget_ms": 1.0}, {"budget_ms": 100.0}, {"max_error": 0.05}, {"max_error": 0.01}]
    rows = [
        {"scene": scene, "budget_ms": np.nan, "max_error": np.nan, "model": model} | limit
        for scene, models in taken.items()
        for model, limit in zip(models, limits, strict=True)
    ]
    table = by_limit(pd.DataFrame(rows), {"b": "second", "a": "first"}, lambda row: row["model"])
    second, first = ["second", "none", "none", "none", "fem"], ["first", "fem", SAME, "springs", "fem"]
    assert table.values.tolist() == [second, first]


def test_a_motion_has_error_bound_and_speed(motions, bounds, presses):
    found = advise_motion(motions, max_errors=[0.05], bounds=bounds, pressed=presses)
    text = lines(found.iloc[0], motions)
    assert "over the whole motion, from a standard that is 0.9 % wrong itself, so 4.9 % with it" in text
    assert "are wrong by less than 7 %; measured on 12 other places of the push, where it held for 90 %" in text
    assert "5 × real time" in text and "2 ms" in text
    assert "beware    pushed elsewhere, its error may be larger than asked, up to 7 %" in text
    assert (
        "\n  estimate  3 % of the displacement, which the model finds without the standard\n" in text
        and "\n  before    500 ms of preparation\n" in text
    )


def test_speeds_are_multiples_of_life(motions, bounds, presses):
    found = advise_motion(motions, speeds=[4, 8, 100], bounds=bounds, pressed=presses)
    assert found["setting"].fillna("").tolist() == ["step_s=0.035", "step_s=0.07", ""]
    assert found["margin"].tolist()[:2] == pytest.approx([0.2, 0.2])
    text = lines(found.iloc[0], motions)
    assert text.startswith("liver_press, 4 × real time: moving_modes step_s=0.035\n")
    assert "\n  margin    20 % of the allowed time is left\n" in text
    step = lines(advise_motion(motions, [1000], bounds=bounds, pressed=presses).iloc[0], motions)
    assert re.search(r"\n  margin    \d+ % of real time and (99|100) % of the time allowed for a step are left\n", step)
    near = lines(found.iloc[2], motions)
    assert re.search(r"\n  nearest   .*with the standard's own error, in 2 ms a step at the 95th percentile\n", near)
    assert "takes 0.1 s for a second of motion" in found["why"].iloc[2]
    assert [pace(times) for times in (35.2, 1.0, 0.2)] == ["35 × real time", "1 × real time", "0.2 × real time"]


def test_where_there_is_no_bound_the_reason_is_given(motions, bounds, presses):
    own = advise_motion(motions, max_errors=[0.05], pressed=presses)
    assert bounded(own.iloc[0]) == "none, as the scene's own motion alone was measured"
    fast = advise_motion(motions, speeds=[8], bounds=bounds, pressed=presses)
    assert bounded(fast.iloc[0]) == "none, as this setting answered at 9 of 12 other places"
    fine = advise_motion(motions, max_errors=[0.024], bounds=bounds, pressed=presses)
    assert bounded(fine.iloc[0]) == "none, as this setting was not asked at the 12 other places"
    assert "beware" not in lines(own.iloc[0], motions) and "elsewhere" not in moved_cell(own.iloc[0])


def test_the_list_of_a_run_has_error_bound_and_speed(motions, bounds, presses):
    found = advise_motion(motions, max_errors=[0.05], speeds=[1, 4], bounds=bounds, pressed=presses)
    listed = advice_list(found)
    assert "4 %, elsewhere below 7 %, 5 × real time (beware: pushed elsewhere" in listed
    assert listed.count("× real time") >= 4 and "4 × real time  " in listed
