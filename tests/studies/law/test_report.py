"""What the report says of laws follows from their table."""

import pytest
from fixtures.material import material, numbers, page

from palpate.studies.law import report as law


def test_the_finding_says_how_much_a_law_changes(law_table):
    text = page("law", {"law": law_table})
    liver = next(line for line in text.splitlines() if line.startswith("**Liver: "))
    assert "1 % (neo-Hookean) to 3 % (St. Venant–Kirchhoff) of the peak" in liver and "changes it by 2 %" in liver
    body = numbers("law", {"law": law_table})["bodies"][1]
    assert [depth.replace("\u00a0", " ") for _, depth in body["laws"]["matters"]] == [
        "from the first depth on at the earliest and from 1 % on at the latest",
        "from 1.7 % on at the earliest and from 5 % on at the latest",
        "at no depth",
    ]
    assert [body["laws"][key] for key in ("patch", "patch_linear")] == pytest.approx([0.045, 0.075])


def test_what_has_no_truth_is_marked(law_table):
    known = law_table["poisson"].ne(0.49)
    doubted = law_table.assign(believed=law_table["believed"] & known)
    doubted["own_rmse_of_peak"] = law_table["own_rmse_of_peak"].where(known, 0.016)
    found = numbers("law", {"law": doubted})
    assert found["own"] == "0.1 %" and found["doubted"] == "ν = 0.49 (1.6 %)"
    assert "changes it by 2 % (known to 1.6 %)" in page("law", {"law": doubted})
    assert numbers("law", {"law": law_table})["doubted"] == "none"


def test_presses_without_an_answer_are_listed(law_table):
    assert numbers("law", {"law": law_table})["lost"] == "1 of the cylinder under St. Venant–Kirchhoff"
    [(what, where, how)] = law.failures(material("law", {"law": law_table}))
    assert (what, where) == ("St. Venant–Kirchhoff", "cylinder")
    assert how.replace("\u00a0", " ") == "no answer at a depth of 10 %: no answer on level 1"
