"""What the report and the claims say of cuts follows from their tables."""

import pytest
from fixtures.material import page

from palpate.report.claims import CONFIRMED, REFUTED
from palpate.studies.cut.claims import compared, limited


@pytest.fixture
def tables(cut, cut_truth, cut_opening):
    return {"cut": cut, "cut_truth": cut_truth, "cut_opening": cut_opening}


def test_a_truth_that_judges_no_model_leaves_no_errors_to_tell(tables):
    unknown = tables["cut"].assign(surface_error=float("nan"), opening_error=float("nan"), force_error=float("nan"))
    text = page("cut", tables | {"cut": unknown})
    assert "nearest" not in text and "no model answers within 100 ms" in text
    assert list(limited({"cut": unknown})) == []


def test_elements_stand_beside_the_best_springs_of_their_level_and_way(cut):
    pairs = compared(cut)
    assert len(pairs) == 4 and set(pairs["way"]) == {"split_faces"}
    assert pairs["slower"].tolist() == pytest.approx([2.0, 2.0, 2.0, 2.0])
    assert pairs["springs_surface_error"].tolist() == pytest.approx([0.3, 0.1, 0.3, 0.1])


def test_the_verdict_follows_from_times_errors_and_failures(cut):
    (claim,) = limited({"cut": cut})
    assert claim.verdict == REFUTED and "2 to 2 times as long" in claim.ours
    assert "of the opening 30 % to 50 %, springs' 20 % to 60 %" in claim.ours
    fem = cut["model"] == "fem"
    for column, factor in (
        ("first_median_s", 20.0),
        ("surface_error", 30.0),
        ("opening_error", 30.0),
        ("surface_error", float("nan")),
    ):
        (claim,) = limited({"cut": cut.assign(**{column: cut[column].where(~fem, factor * cut[column])})})
        assert claim.verdict == CONFIRMED
