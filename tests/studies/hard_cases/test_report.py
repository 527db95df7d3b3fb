"""The part about hard cases counts the outcomes of their table."""

from fixtures.material import material, numbers, page

from palpate.studies.hard_cases import report as hard_cases


def test_outcomes_are_counted(hard_cases_table):
    found = numbers("hard_cases", {"hard_cases": hard_cases_table})
    counts = {name: found[name] for name in ("cases", "runs", "bad", "known", "undeclared", "answers", "reasons")}
    assert list(counts.values()) == [4, 5, 2, 0, 2, 3, 2] and (found["sharp"], found["stable"]) == (2, 2)
    assert found["outcomes"] == {"stable": 2, "refused": 1, "not a number": 1, "wrong": 1}
    assert found["locking"] == {"level 0": 0.4, "level 2 softer": 0.04}
    text = " ".join(page("hard_cases", {"hard_cases": hard_cases_table}).split())
    assert (
        "2 gave a wrong answer, none of them known and declared, and 2 ended otherwise than declared beforehand" in text
    )
    assert "40 % (level 0), 4 % (level 2 softer)" in text


def test_what_ended_as_declared_is_no_failure(hard_cases_table):
    failed = list(hard_cases.failures(material("hard_cases", {"hard_cases": hard_cases_table})))
    assert failed == [
        ("finite elements", "drop", "not a number; declared: stable"),
        ("corrected coarse FEM", "one sample", "wrong; declared: stable"),
    ]
    declared = hard_cases_table.assign(passed=True)
    assert list(hard_cases.failures(material("hard_cases", {"hard_cases": declared}))) == []
    assert "every one ended as declared" in page("hard_cases", {"hard_cases": declared})
