"""Words about advice name what the tables have: model, error, bound, time, and what was passed over."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.advice import advise
from palpate.benchmark.advice_other_loads import advise_motion
from palpate.report import tables
from palpate.report.advice_words import advice_list, behind, bounded, lines, moved_cell, next_best, pace


@pytest.fixture
def liver(advised_tables):
    return [tables.where(table, scene="liver_small") for table in advised_tables]


@pytest.fixture
def pressed(trade_off):
    settings, errors = trade_off
    return settings[settings["scene"] == "liver_small"], errors["liver_small"]


@pytest.fixture
def motions(dynamic_table):
    table = dynamic_table[dynamic_table["scene"] == "liver_press"].replace({"springs": "moving_modes"})
    table = table.replace({"setting": {"step_s=0.002": "step_s=0.07", "step_s=0.001": "step_s=0.035"}})
    return table.assign(estimate_of_peak=0.03, ms_per_step=1.0, step_p95_ms=2.0, p95_of_peak=0.06, offline_s=0.5)


@pytest.fixture
def bounds():
    row = {"scene": "liver_press", "model": "moving_modes", "setting": "step_s=0.035", "estimate": "constant"}
    row |= {"places": 12, "failures": 0, "bound_of_peak": 0.07, "coverage": 0.9}
    return pd.DataFrame([row, row | {"setting": "step_s=0.07", "bound_of_peak": np.nan, "failures": 3}])


def test_lines_name_model_error_time_and_what_is_left(liver):
    settings, advised = liver
    none, first, second = (lines(advised.iloc[i], settings) for i in range(3))
    assert none.startswith(
        "liver_small, within 0.01 ms: none\n  because   the fastest setting, linear_fem, takes 0.012"
    )
    assert first.startswith("liver_small, within 1 ms: linear_fem\n  error     5 % of the peak displacement (")
    assert "  margin    99 % of the allowed time is left" in first and "has 4 times the error" in first
    assert "error     0.4 % of" in second and "6 ms at the 95th percentile" in second
    assert "the truth is known to 0.15 % only (on the test contacts)" in lines(advised.iloc[5], settings)


def test_both_kinds_of_error_are_named(pressed):
    surface, patch = (row for _, row in advise(*pressed, [16.7]).iterrows())
    assert "at the patch 2 %" in lines(surface, pressed[0]) and "over the whole surface 0.41 %" in lines(
        patch, pressed[0]
    )
    assert "agreed    the same in 3 of 5" in lines(surface, pressed[0], "the same in 3 of 5")


def test_the_bound_of_a_single_answer_is_named_where_there_is_one(liver):
    settings, advised = liver
    row = advised.iloc[1].copy()
    assert np.isnan(row["bound_of_peak"]) and "bound" not in lines(row, settings)
    row["bound_of_peak"] = 0.084
    assert "\n  bound     nine answers in ten at other contacts are wrong by less than 8.4 %\n" in lines(row, settings)


def test_an_error_above_the_limit_comes_first(pressed):
    row = advise(*pressed, [], [0.05], kinds=["rms"]).iloc[0].copy()
    assert "larger than asked" not in lines(row, pressed[0])
    row["rmse_of_peak"], row["margin"] = 0.08, -24.0
    printed = lines(row, pressed[0]).splitlines()
    assert printed[1] == "  beware    on the test contacts its error is larger than asked, 8 %"
    assert "  margin    nothing of the allowed error is left" in printed
    assert advice_list(row.to_frame().T).splitlines()[1].endswith("larger than asked, 8 %)")


def test_the_next_best_model_is_compared(liver, pressed):
    assert next_best(liver[1].iloc[4]) == "the next best model, POD + RBF, is about as fast"
    row = advise(*pressed, [1], kinds=["rms"]).iloc[0].copy()
    row["factor"] = 0.72
    assert behind(row) == "has 0.72 times the error on test contacts"


def test_the_list_is_of_one_kind(pressed):
    advice = advise(*pressed, [16.7], [0.05])
    surface, patch = advice_list(advice).splitlines(), advice_list(advice, "patch").splitlines()
    assert "of the peak displacement; time" in surface[0] and "at the patch; time" in patch[0]
    assert surface[1].endswith("corrected coarse FEM (samples=60): 0.4 %, 6 ms")
    assert patch[1].endswith("POD + RBF (modes=8): 0.62 %, 6 ms") and len(surface) == len(patch) == 3
    assert advice_list(advice[advice["error"] == "rms"], "patch") == "No scene has advice about that kind of error."


def test_a_motion_has_error_bound_and_speed(motions, bounds):
    found = advise_motion(motions, max_errors=[0.046], bounds=bounds)
    text = lines(found.iloc[0], motions)
    assert "4 % of the peak displacement over the whole motion; with the reference's own 0.5 % added, 4.5 %" in text
    assert "are wrong by less than 7 %; measured on 12 other places of the push, where it held for 90 %" in text
    assert "5 times as fast as life" in text and "2 ms" in text
    assert "beware    pushed elsewhere, its error may be larger than asked, up to 7 %" in text
    assert "\n  itself    says that it is wrong by 3 %\n" in text and "\n  before    500 ms of preparation\n" in text


def test_speeds_are_multiples_of_life(motions, bounds):
    found = advise_motion(motions, speeds=[4, 8, 100], bounds=bounds)
    assert found["setting"].fillna("").tolist() == ["step_s=0.035", "step_s=0.07", ""]
    assert found["margin"].tolist()[:2] == pytest.approx([0.2, 0.2])
    text = lines(found.iloc[0], motions)
    assert text.startswith("liver_press, 4 times as fast as life: moving_modes step_s=0.035\n")
    assert "takes 0.1 s for a second of motion" in found["why"].iloc[2]
    assert [pace(times) for times in (35.2, 1.0, 0.2)] == [
        "35 times as fast as life", "1 times as fast as life", "5 times slower than life",
    ]  # fmt: skip


def test_where_there_is_no_bound_the_reason_is_given(motions, bounds):
    own = advise_motion(motions, max_errors=[0.046])
    assert bounded(own.iloc[0]) == "none, as the scene's own motion alone was measured"
    fast = advise_motion(motions, speeds=[8], bounds=bounds)
    assert bounded(fast.iloc[0]) == "none, as this setting answered at 9 of 12 other places"
    fine = advise_motion(motions, max_errors=[0.02], bounds=bounds)
    assert bounded(fine.iloc[0]) == "none, as this setting was not asked at the 12 other places"
    assert "beware" not in lines(own.iloc[0], motions) and "elsewhere" not in moved_cell(own.iloc[0])


def test_the_list_of_a_run_has_error_bound_and_speed(motions, bounds):
    found = advise_motion(motions, max_errors=[0.046], speeds=[1, 4], bounds=bounds)
    listed = advice_list(found)
    assert "4 %, elsewhere below 7 %, 5 times as fast as life (beware: pushed elsewhere" in listed
    assert listed.count("times as fast as life") >= 4 and "4 times as fast as life  " in listed
