"""Sentences about scenes that move: error, bound, what that was measured on, speed; alike in terminal and report."""

import numpy as np
import pandas as pd
import pytest
from palpate.studies.tradeoff.motion_words import bounded, brief, lines, pace, sentence

from palpate.benchmark.advice_other_loads import advise_motion
from palpate.report.advice_words import advice_list

MODES = "vibration and contact modes (step_s=0.035)"


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


def said(advice, motions):
    return lines(advice.iloc[0], motions), sentence(advice.iloc[0]).replace("\u00a0", " ")


def test_advice_says_error_bound_and_speed_in_the_same_words(motions, bounds):
    found = advise_motion(motions, max_errors=[0.046], bounds=bounds)
    for text in said(found, motions):
        assert "4 % of the peak displacement over the whole motion; with the reference's own 0.5 % added, 4.5 %" in text
        assert (
            "nine motions in ten, pushed as hard elsewhere, are wrong by less than 7 %; measured on 12 other places of "
            "the push, where it held for 90 % of the places held out"
        ) in text
        assert "5 times as fast as life" in text and "2 ms" in text
        assert "ushed elsewhere, its error may be larger than asked, up to 7 %" in text
    terminal, report = said(found, motions)
    assert (
        "\n  itself    says that it is wrong by 3 %\n" in terminal
        and "\n  before    500 ms of preparation\n" in terminal
    )
    assert report.startswith(f"Error of at most 4.6 %: {MODES[0].upper()}{MODES[1:]}") or MODES in report


def test_speeds_are_multiples_of_life(motions, bounds):
    found = advise_motion(motions, speeds=[4, 8, 100], bounds=bounds)
    assert found["setting"].tolist() == ["step_s=0.035", "step_s=0.07", ""]
    assert found["margin"].tolist()[:2] == pytest.approx([0.2, 0.2])
    terminal, report = said(found, motions)
    assert terminal.startswith("liver_press, 4 times as fast as life: moving_modes step_s=0.035\n")
    assert report.startswith("4 times as fast as life: ") and "which leaves 20 % of the time" in report
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
    assert "beware" not in lines(own.iloc[0], motions) and "elsewhere" not in brief(own.iloc[0])


def test_the_list_of_a_run_has_error_bound_and_speed(motions, bounds):
    found = advise_motion(motions, max_errors=[0.046], speeds=[1, 4], bounds=bounds)
    listed = advice_list(found)
    assert "4 %, elsewhere below 7 %, 5 times as fast as life (beware: pushed elsewhere" in listed
    assert listed.count("times as fast as life") >= 4 and "4 times as fast as life  " in listed
