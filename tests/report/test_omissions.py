"""Everything that failed is listed, with where and how."""

from types import SimpleNamespace

from fixtures.material import material

from palpate.report import omissions
from palpate.studies.enrichment import report as enrichment


def test_methods_without_an_answer(results):
    report = material("enrichment", {"enrichment_accuracy": results["enrichment_accuracy"]})
    found = omissions.found(report)
    assert set(found["what"]) == {"POD + RBF"} and len(found) == 8
    assert found["where"].iloc[0] == "own, small loads, paper protocol, samples held out"
    assert set(found["comparison"]) == {enrichment.TITLE}
    assert omissions.numbers(report) == {"headline": f"Every failure is listed: 8 in “{enrichment.TITLE}”."}


def test_nothing_failed(results):
    report = material("enrichment", {"enrichment_accuracy": results["enrichment_accuracy"].fillna(0.1)})
    assert omissions.found(report).empty
    assert omissions.numbers(report) == {"headline": "Nothing failed."}
    ((_, _, text),) = omissions.sections(report)
    assert text == "<p>Nothing failed.</p>"


def test_a_part_without_failures_is_passed_over():
    report = material("enrichment", {})
    report.studies = {"toy": SimpleNamespace(TITLE="Toy")}
    assert omissions.found(report).empty


def test_what_papers_leave_open_is_said_only_where_one_is_repeated(results):
    table = {"enrichment_accuracy": results["enrichment_accuracy"].fillna(0.1)}
    of_mine, of_paper = (material("enrichment", table, published).of("omissions") for published in ({}, {"nodes": 140}))
    assert [title for _, title, _ in omissions.sections(of_mine)] == ["What failed"]
    (_, title, text), _ = omissions.sections(of_paper)
    assert title == "Numbers that the papers do not give" and "Paper 1 gives neither the material" in text
    assert "aper" not in of_mine.note("omissions")
