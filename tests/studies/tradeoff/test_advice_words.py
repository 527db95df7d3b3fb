"""Sentences about advice name what the tables have."""

import numpy as np
import pytest
from palpate.studies.tradeoff.advice_words import lines, sentence

from palpate.report import tables


@pytest.fixture
def liver(advised_tables):
    return [tables.where(table, scene="liver_small") for table in advised_tables]


def test_sentences_name_model_error_time_and_rival(liver):
    _, advised = liver
    said = [sentence(row).replace("\u00a0", " ") for _, row in advised.iterrows()]
    assert said[0].startswith("Within 0.01 ms: none, because the fastest setting, linear fine FEM, takes 0.012 ms")
    assert said[1].startswith("Within 1 ms: linear fine FEM. Its error is 5 % (")
    assert said[1].endswith(
        "which leaves 99 % of the time. The next best model, shape matching (steps=30), has 4 times the error."
    )
    assert "error is 0.4 % (" in said[2] and "its time 6 ms at the 95th percentile, which leaves 64 %" in said[2]
    assert said[3].endswith("Below 0.15 %, the truth's own error, models are tied and the fastest is taken.")
    assert said[4].startswith("Error of at most 5 %: corrected coarse FEM (samples=60)")
    assert said[4].endswith("The next best model, POD + RBF (modes=8), is about as fast.")
    assert "none, because the truth is known to 0.15 % only (on the test contacts), so that no smaller error" in said[5]
    assert said[8].startswith(
        "Within 16.7 ms: POD + RBF (modes=8). Its error at the patch is 0.62 % (0.46 % to 0.77 %)"
    )


def test_sentences_say_the_bound_of_a_single_answer_where_there_is_one(liver):
    settings, advised = liver
    row = advised.iloc[1].copy()
    assert np.isnan(row["bound_of_peak"]) and "nine" not in sentence(row) and "bound" not in lines(row, settings)
    row["bound_of_peak"] = 0.084
    said = "ine answers in ten at other contacts are wrong by less than 8.4 %"
    assert f" N{said}. The next best" in sentence(row).replace("\u00a0", " ")
    assert f"\n  bound     n{said}\n" in lines(row, settings)


def test_sentences_say_what_was_passed_over_and_what_is_added(liver):
    row = liver[1].iloc[1].copy()
    row[["faster", "faster_setting", "faster_error", "faster_high", "faster_factor"]] = (
        "pod_rbf",
        "modes=8",
        0.02,
        0.06,
        33,
    )
    row["reference_error"] = 0.16
    assert (
        sentence(row)
        .replace("\u00a0", " ")
        .endswith(
            "POD + RBF (modes=8) is 33 times as fast and was passed over, as its error of 2 % may be up to 6 %. "
            "Below 16 %, the truth's own error, models are tied and the fastest is taken."
        )
    )
    row[["error_low", "error_high", "faster_factor", "budget_ms"]] = np.nan
    row[["reference_error", "max_error"]] = 0.0023, 0.1
    assert (
        sentence(row).replace("\u00a0", " ").endswith("The error that is judged includes the reference's own, 0.23 %.")
    )
