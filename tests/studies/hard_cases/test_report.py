"""The part about hard cases counts the outcomes of their table."""

from fixtures.material import failures, page


def test_what_ended_as_declared_is_no_failure(hard_cases_table):
    assert failures("hard_cases", {"hard_cases": hard_cases_table}) == [
        ("finite elements", "drop", "not a number; declared: stable"),
        ("corrected coarse FEM", "one sample", "wrong; declared: stable"),
    ]
    declared = hard_cases_table.assign(passed=True)
    assert failures("hard_cases", {"hard_cases": declared}) == []
    assert "every one ended as declared" in page("hard_cases", {"hard_cases": declared})
