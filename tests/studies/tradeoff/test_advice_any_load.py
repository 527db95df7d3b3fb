"""What answers all loads of a kind comes first; what says which it cannot answer comes after it, with its share."""

import pandas as pd
import pytest
from palpate.studies.tradeoff.any_load_words import brief, lines
from palpate.studies.tradeoff.tables import TABLES

from palpate.benchmark.advice import NONE
from palpate.benchmark.advice_other_loads import advise_any_load


def rows(*told):
    """Rows of any_load.csv of new places: model, error, time [ms], and how many of four loads are doubted or failed."""
    found = []
    for model, error, time, doubted, failures in told:
        row = {"scene": "liver_large", "model": model, "setting": "default", "kind": "never prepared", "samples": 4}
        row |= {"refused": 0, "doubted": doubted, "failures": failures, "contacts": 4 - doubted - failures}
        row |= {"rmse_of_peak": error, "rmse_of_peak_most": 1.5 * error, "online_median_s": 1e-3 * time}
        row |= {"online_p95_s": 1.1e-3 * time, "preparation_s": 0.0, "offline_s": 2.0, "memory_mb": 5.0}
        found.append(row)
    return pd.DataFrame(found).reindex(columns=TABLES["any_load"].columns.split())


EXACT, COARSE, LOST = ("modes", 0.004, 1.0, 1, 0), ("coarse", 0.05, 2.0, 0, 0), ("lost", 0.001, 0.1, 0, 1)


def test_a_model_that_doubts_is_advised_where_nothing_answers_all():
    found = advise_any_load(rows(EXACT, COARSE, LOST), "never prepared", max_error=0.01)
    assert (found.model, found.doubted, found.samples, found.most) == ("modes", 1, 4, pytest.approx(0.006))
    assert "nothing that answers all of them meets" in found.why
    said = lines(found)
    assert "doubts    1 of 4 loads (25 %)" in said and "of those that it answers, 75 % of such loads" in said
    assert brief(found).endswith(", doubts 1 of 4 loads")


def test_a_model_that_answers_all_comes_first_and_what_was_passed_over_is_named():
    found = advise_any_load(rows(EXACT, COARSE, LOST), "never prepared", budget_ms=10)
    assert (found.model, found.doubted, found.sure) == ("coarse", 0, 0.8)
    assert "modes has 0.08 of the error and was passed over, as it doubts 1 of 4 loads" in found.why
    assert "doubts" not in lines(found).split("because")[0] and "0.8" not in brief(found)
    assert "80 % of such loads at another place are answered with an error of less than 7.5 %" in lines(found)
    worse = advise_any_load(rows(("modes", 0.2, 1.0, 1, 0), COARSE), "never prepared", budget_ms=10)
    assert "passed over" not in worse.why


def test_of_those_that_doubt_the_one_of_fewest_doubts_comes_first():
    found = advise_any_load(rows(("often", 0.001, 0.1, 3, 0), EXACT), "never prepared", max_error=0.01)
    assert found.model == "modes"


def test_what_failed_without_saying_so_or_doubts_all_is_never_advised():
    never = ("never", float("nan"), 0.1, 4, 0)
    found = advise_any_load(rows(LOST, never), "never prepared", max_error=0.5)
    assert found.model == NONE and found.why.startswith("no setting has answered all loads")
    least = advise_any_load(rows(EXACT), "never prepared", max_error=1e-6)
    assert least.model == NONE and "in 1.1 ms, doubts 1 of 4 loads" in least.why
