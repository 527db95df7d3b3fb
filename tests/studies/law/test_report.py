"""What the report says of laws follows from their table."""

from fixtures.material import failures, numbers, page


def test_the_finding_says_how_much_a_law_changes(law_table):
    found = numbers("law", {"law": law_table})
    text = " ".join(page("law", {"law": law_table}).split())
    assert "Liver: answers change by up to 3 % of the peak under another law, 2 % with another Poisson's ratio." in text
    liver = found["summary"].query("body == 'liver'").set_index("changed to")
    columns = [f"more than that of {mesh}" for mesh in ("the truth", "quadratic elements on the finest mesh")]
    assert [depth.replace("\u00a0", " ") for depth in liver.loc["St. Venant–Kirchhoff", columns]] == [
        "from the first depth on", "from 1.7 % on",
    ]  # fmt: skip


def test_what_has_no_truth_is_marked(law_table):
    known = law_table["poisson"].ne(0.49)
    doubted = law_table.assign(believed=law_table["believed"] & known)
    doubted["own_rmse_of_peak"] = law_table["own_rmse_of_peak"].where(known, 0.016)
    assert numbers("law", {"law": doubted})["doubted"] == "ν = 0.49 (1.6 %)"
    assert numbers("law", {"law": law_table})["doubted"] == "none"


def test_presses_without_an_answer_are_listed(law_table):
    [failure] = failures("law", {"law": law_table})
    assert failure == ("St. Venant–Kirchhoff", "cylinder", "no answer at a depth of 10 %: no answer on level 1")
