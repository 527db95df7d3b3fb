"""Sentences about advice say of which kind the error is, what was passed over, and how well the truth is known."""

import numpy as np
import pytest
from palpate.studies.tradeoff.advice_words import behind, lines, sentence

from palpate.benchmark.advice import advise
from palpate.report.advice_words import advice_list


@pytest.fixture
def liver(trade_off):
    settings, errors = trade_off
    return settings[settings["scene"] == "liver_small"], errors["liver_small"]


def said(row) -> str:
    return sentence(row).replace("\u00a0", " ")


def test_the_kind_of_error_is_said(liver):
    surface, patch = (row for _, row in advise(*liver, [16.7]).iterrows())
    assert said(surface).startswith("Within 16.7 ms: corrected coarse FEM (samples=60). Its error is 0.4 % (")
    assert said(patch).startswith("Within 16.7 ms: POD + RBF (modes=8). Its error at the patch is 0.62 % (")
    assert "at the patch 2 %" in lines(surface, liver[0]) and "over the whole surface 0.41 %" in lines(patch, liver[0])
    assert "agreed    the same in 3 of 5" in lines(surface, liver[0], "the same in 3 of 5")


def test_sentences_say_what_was_passed_over_and_how_well_the_truth_is_known(liver):
    row = advise(*liver, [1], kinds=["rms"]).iloc[0].copy()
    faster = ["faster", "faster_setting", "faster_error", "faster_high", "faster_factor"]
    row[faster] = "pod_rbf", "modes=8", 0.02, 0.06, 33
    row["reference_error"] = 0.16
    assert said(row).endswith(
        "POD + RBF (modes=8) is 33 times as fast and was passed over, as its error of 2 % may be up to 6 %. "
        "Below 16 %, the truth's own error, models are tied and the fastest is taken."
    )
    row["budget_ms"], row["max_error"] = np.nan, 0.1
    row[["error_low", "error_high", "faster_factor"]], row["reference_error"] = np.nan, 0.0023
    assert said(row).endswith("The error that is judged includes the reference's own, 0.23 %.")


def test_the_list_is_of_one_kind(liver):
    advice = advise(*liver, [16.7], [0.05])
    surface, patch = advice_list(advice).splitlines(), advice_list(advice, "patch").splitlines()
    assert "of the peak displacement; time" in surface[0] and "at the patch; time" in patch[0]
    assert surface[1].endswith("corrected coarse FEM (samples=60): 0.4 %, 6 ms")
    assert patch[1].endswith("POD + RBF (modes=8): 0.62 %, 6 ms") and len(surface) == len(patch) == 3
    assert advice_list(advice[advice["error"] == "rms"], "patch") == "No scene has advice about that kind of error."


def test_an_error_above_the_limit_is_said_first(liver):
    row = advise(*liver, [], [0.05], kinds=["rms"]).iloc[0].copy()
    assert "larger than asked" not in said(row) + lines(row, liver[0])
    row["rmse_of_peak"], row["margin"] = 0.08, -24.0
    assert "(samples=60). On the test contacts its error is larger than asked, 8 %. Its error is 8 %" in said(row)
    printed = lines(row, liver[0]).splitlines()
    assert printed[1] == "  beware    on the test contacts its error is larger than asked, 8 %"
    assert "  margin    nothing of the allowed error is left" in printed
    assert advice_list(row.to_frame().T).splitlines()[1].endswith("larger than asked, 8 %)")


def test_a_next_best_model_that_tests_better_is_called_so(liver):
    row = advise(*liver, [1], kinds=["rms"]).iloc[0].copy()
    row["factor"] = 0.72
    assert behind(row) == "has 0.72 times the error on test contacts"
