"""The part about hard cases counts the outcomes of their table."""

from fixtures.material import failures, page


def test_outcomes_are_counted(hard_cases_table):
    text = " ".join(page("hard_cases", {"hard_cases": hard_cases_table}).split())
    assert "4 hard cases in 5 runs: 2 gave a wrong answer, none of them known and declared, and 2 ended other" in text
    assert "2 of 2 bounds" in text and "3 runs gave an answer" in text
    assert all(count in text for count in ("2 stable", "1 refused", "1 not a number", "1 wrong"))
    assert "40 % (level 0), 4 % (level 2 softer)" in text


def test_what_ended_as_declared_is_no_failure(hard_cases_table):
    assert failures("hard_cases", {"hard_cases": hard_cases_table}) == [
        ("finite elements", "drop", "not a number; declared: stable"),
        ("corrected coarse FEM", "one sample", "wrong; declared: stable"),
    ]
    declared = hard_cases_table.assign(passed=True)
    assert failures("hard_cases", {"hard_cases": declared}) == []
    assert "every one ended as declared" in page("hard_cases", {"hard_cases": declared})
