"""All claims stand in one table, with what they were tested on, and are counted."""

import pandas as pd
from fixtures.material import material

from palpate.report import paper_claims, verdicts


def rows(**changed):
    """A confirmed claim of each paper; columns changed as said."""
    one = {"section": "4", "claim": "a_b=3", "premise": "a cube", "published": "5", "ours": "5", "verdict": "confirmed"}
    papers = {"paper": [1, 2, 3], "study": ["enrichment", "springs", "collision"]}
    return pd.DataFrame(one | changed | papers)


def test_without_claims_there_is_no_part():
    report = material("tradeoff", {})
    assert verdicts.sections(report) == [] and verdicts.numbers(report) == {}
    assert paper_claims.section(report, "tradeoff") == []


def test_verdicts_are_counted_without_their_reasons():
    judged = rows(verdict=["confirmed", "not testable: no data", "not testable: no machine"], claim=["a", "b", "b"])
    said = verdicts.numbers(material("collision", {"claims": judged}))["headline"]
    assert said == "3 tests of 2 claims of the papers: 2 not testable, 1 confirmed."
    (_, _, counts), (_, _, table), (_, _, tests) = verdicts.sections(material("collision", {"claims": judged}))
    assert "not testable: no data" in tests and "<b>Table claims</b>, 3 rows." in tests
    assert table.count("<tr") == 4  # with the heading: claims of two papers are not united
    assert "<td>2</td>" in counts.replace(' class="number"', "")


def test_models_are_named_in_words():
    shown = paper_claims.shown(rows(ours="ordered_nonnegative_a: 0.2; nonnegative_b: 0.1"))
    assert shown["this run"][0] == "contact-ordered, non-negative (a): 0.2; non-negative (b): 0.1"
    assert shown["claim"][0] == "a_b=3"
    assert list(shown) == ["paper", "section", "claim", "verdict", "tested on", "the paper", "this run"]


def test_the_tests_of_a_claim_are_united():
    judged = pd.concat([rows(), rows(), rows(verdict="refuted")]).assign(paper=[1, 2, 3, 1, 2, 3, 1, 2, 2])
    found = paper_claims.united(judged)
    assert found["tests"].tolist() == [3, 4, 2]
    assert found["verdict"].tolist() == ["confirmed (2), refuted (1)", "confirmed (2), refuted (2)", "confirmed"]
    assert (
        paper_claims.united(rows(verdict="not testable: no data"))["verdict"].tolist() == ["not testable: no data"] * 3
    )


def test_a_part_shows_the_claims_of_its_own_study():
    report = material("collision", {"claims": rows(claim=["of one", "of two", "of three"])})
    ((key, _, text),) = paper_claims.section(report, "collision")
    assert key == "collision_claims" and "of three" in text and "of one" not in text
