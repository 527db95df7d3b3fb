"""Sentences about collision follow from their tables."""

from fixtures.material import material, numbers

from palpate.studies.collision import report as collision

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
    assert found["collision_verdicts"] == "none judged"
    assert "takes 1.5 ms on one core with AABBs (coal, OBBs, rebuilt: 12 ms)." in found["headline"]


def test_verdicts_on_composite_trees_are_counted(collision_results, claims):
    found = numbers("collision", collision_results | {"claims": claims}, PUBLISHED)
    # composite 4/2 is between both, 8/4 is as fast as spheres and four times as loose as AABBs
    assert found["collision_verdicts"] == ("query time 1 confirmed, 1 not testable; false pairs 1 confirmed, 1 refuted")


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
