"""Sentences about hard cases count the outcomes of their table."""

from fixtures.material import material, numbers

from palpate.studies.hard_cases import report as hard_cases


def test_sentences_count_outcomes(hard_cases_table):
    found = numbers("hard_cases", {"hard_cases": hard_cases_table})
    assert found["headline"] == (
        "4 hard cases in 5 runs: 2 gave a wrong answer, 0 of them a known one, and 2 ended otherwise than declared "
        "beforehand."
    )
    assert found["hard_cases_outcomes"] == "2 stable, 1 refused, 1 not a number, 1 wrong"
    assert found["hard_cases_locking"] == "40 % (level 0), 4 % (level 2 softer)"
    assert found["hard_cases_answers"] == "3" and found["hard_cases_reasons"] == "2"
    assert found["hard_cases_sharp"] == "2 of 2"
    untried = hard_cases_table[hard_cases_table["family"] == "enrichment"]
    assert numbers("hard_cases", {"hard_cases": untried})["hard_cases_locking"] == "not run"


def test_what_ended_as_declared_is_no_failure(hard_cases_table):
    failed = list(hard_cases.failures(material("hard_cases", {"hard_cases": hard_cases_table})))
    assert failed == [
        ("fem", "drop", "not a number; declared: stable"),
        ("corrected coarse FEM", "one sample", "wrong; declared: stable"),
    ]
    declared = hard_cases_table.assign(passed=True)
    assert list(hard_cases.failures(material("hard_cases", {"hard_cases": declared}))) == []
    assert "every one ended as declared" in numbers("hard_cases", {"hard_cases": declared})["headline"]
