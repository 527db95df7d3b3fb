"""Sentences about hard cases count the outcomes of their table."""

from palpate.report.parts import hard_cases_numbers


def test_sentences_count_outcomes(hard_cases_table):
    found = hard_cases_numbers.numbers({"hard_cases": hard_cases_table})
    assert found["headline_hard_cases"] == (
        "4 hard cases, 5 runs: 2 wrong or not a number; 2 went otherwise than declared beforehand."
    )
    assert found["hard_cases_outcomes"] == "2 stable, 1 refused, 1 nan, 1 wrong"
    assert found["hard_cases_locking"].replace("\u00a0", " ") == "40 % level 0, 4 % level 2 softer"
    untried = hard_cases_numbers.numbers({"hard_cases": hard_cases_table[hard_cases_table["family"] == "enrichment"]})
    assert untried["hard_cases_locking"] == "not run"
