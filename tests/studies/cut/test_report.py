"""What the report and the claims say of cuts follows from their tables."""

import pytest
from fixtures.drawn import texts
from fixtures.material import material, page

from palpate.report.claims import CONFIRMED, REFUTED
from palpate.studies.cut import figures
from palpate.studies.cut import report as part
from palpate.studies.cut.claims import compared, limited


@pytest.fixture
def tables(cut, cut_truth, cut_opening):
    return {"cut": cut, "cut_truth": cut_truth, "cut_opening": cut_opening}


def test_the_finding_says_who_is_nearest_and_who_is_soon(tables):
    text = page("cut", tables)
    liver = next(line for line in text.splitlines() if line.startswith("**Liver cut: "))
    assert "the lips open by 4.2 mm, known to 0.7 %; 8 of 9 settings follow" in liver
    assert "mesh made anew, level 1, in 2 s (surface 1 % off, opening 4 %, force 5 %)" in liver
    assert "within 100 ms of the blade's move, linear responses, compliance updated, level 1, in 40 ms" in liver
    assert "is followed within 16.7 ms, whatever its step, best by linear responses with jumps" in liver
    assert "in quadratic elements, level 0, in 12 ms (surface 8 % off" in liver
    assert "the lips have no truth, as the lips close (overlap 1 mm)" in text
    assert "[figure cut_precision_pad_cut]" in text and "[figure cut_opening_pad_cut]" in text


def test_a_truth_that_judges_no_model_leaves_no_errors_to_tell(tables):
    unknown = tables["cut"].assign(surface_error=float("nan"), opening_error=float("nan"), force_error=float("nan"))
    assert "Nearest" not in page("cut", tables | {"cut": unknown})
    assert list(limited({"cut": unknown})) == []


def test_what_fails_is_listed(tables):
    failed = list(part.failures(material("cut", tables)))
    assert failed[0] == ("XPBD (level=1, steps=20)", "liver cut", "lost") and len(failed) == 2


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


def test_every_model_and_way_is_drawn(cut, cut_opening):
    drawn = texts(figures.draw_cut_precision(cut, scene="liver_cut"))
    assert {"finite elements", "springs", "XPBD", "mesh made anew", "compliance updated"} <= set(drawn)
    assert any(text.startswith("no answer: XPBD") for text in drawn)
    figure = figures.draw_cut_opening(cut_opening, scene="liver_cut")
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["liver cut, level 0", "liver cut, level 1"]
    springs = next(line for line in figure.axes[1].lines if line.get_label().startswith("springs"))
    assert max(springs.get_ydata()) == pytest.approx(0.6 * 4.0)
