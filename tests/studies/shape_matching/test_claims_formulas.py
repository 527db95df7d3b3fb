"""Claims that follow from paper 3's formulas are judged by them."""

from palpate.report.claims import CONFIRMED, REFUTED
from palpate.studies.shape_matching import claims


def judged():
    return {(row.claim.split()[0], row.premise.split()[-1]): row for row in claims.formulas({})}


def test_a_force_that_depends_on_position_would_be_noticed(monkeypatch):
    assert judged()["forces", "1"].verdict == CONFIRMED
    recursion = claims._run
    monkeypatch.setattr(claims, "_run", lambda x, alpha, force: recursion(x, alpha + 0.1 * force.any(), force))
    assert judged()["forces", "1"].verdict == REFUTED


def test_the_volume_is_kept_without_a_share_of_rotation_only():
    assert judged()["linear", "1"].verdict == CONFIRMED
    mixed = judged()["linear", "0.8"]
    # (0.8 a + 0.2) (0.8 / sqrt(a) + 0.2)² = 1.0086 with a = 1.5^(2/3)
    assert (mixed.verdict, mixed.ours) == (REFUTED, "the goals' volume is 0.86 % larger")
