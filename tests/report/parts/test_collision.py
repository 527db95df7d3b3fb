"""Sentences about collision follow from their tables."""

from fixtures.material import material, numbers

from palpate.report.parts import collision

PUBLISHED = {"source": "thesis"}


def test_sentences_come_from_the_tables(collision_results):
    found = numbers("collision", collision_results, PUBLISHED)
    assert found["collision_missed"] == "0 pairs missed or reported wrongly in 1,600 frames"
    assert found["collision_fastest"] == "two livers: AABBs, 1.5 ms; folding sheet: AABBs, 1.5 ms"
    assert found["collision_rivals"] == "coal, OBBs, rebuilt: two livers 8.0"
    assert found["collision_wrong"] == "coal, OBBs, rebuilt 7 missed and 3 reported wrongly"
    assert found["collision_exponents"] == "build n^1.00 to n^1.00, refit n^1.00 to n^1.00, query n^0.50 to n^0.50"
    # 2.5 ms against 1.5 ms
    assert found["collision_plain"] == "composite 4/2 takes 1.67 times as long"
    assert found["collision_verdicts"] == "query time confirmed in 1 of 1 rows"
    claims = collision_results["collision_claims"]
    tied = collision_results | {"collision_claims": claims.assign(verdict="tied")}
    said = numbers("collision", tied, PUBLISHED)["collision_verdicts"]
    assert said == "query time confirmed in 0 of 1 rows (1 are ties within 5 %)"
    assert "takes 1.5 ms on one core with AABBs (coal, OBBs, rebuilt: 12 ms)." in found["headline"]


def test_without_rivals_nothing_is_said_of_them(collision_results):
    table = collision_results["collision"]
    found = numbers("collision", collision_results | {"collision": table[~table["rival"]]}, PUBLISHED)
    assert found["headline"].endswith("on one core with AABBs.")
    assert found["collision_rivals"] == "none is installed"


def test_structures_with_wrong_pairs_have_failed(collision_results):
    report = material("collision", collision_results)
    assert list(collision.failures(report)) == [
        ("coal, OBBs, rebuilt", "two livers", "7 crossing pairs missed, 3 reported wrongly")
    ]
