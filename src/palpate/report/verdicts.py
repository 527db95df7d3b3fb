"""List the claims of all papers: how many hold, one row a claim, and every test of them, which is claims.csv."""

from palpate.report import markup
from palpate.report.material import Report, Section
from palpate.report.paper_claims import counted, found, said, shown, united
from palpate.report.table import SHARED

TITLE = "The papers' claims, checked"
TABLES: dict = {}


def numbers(report: Report) -> dict[str, str]:
    """Return the placeholders of this part, as text."""
    claims = found(report)
    if claims.empty:
        return {}
    tests = f"{len(claims)} tests of {claims['claim'].nunique()} claims of the papers"
    return {"headline": f"{tests}: {said(counted(claims['verdict']))}."}


def sections(report: Report) -> list[Section]:
    """Return how many claims hold, a row for each, and all tests; none if no study reproduces a paper."""
    claims = found(report)
    if claims.empty:
        return []
    counts = claims.groupby("paper")["verdict"].apply(counted).unstack(fill_value=0)
    counts = counts[list(counted(claims["verdict"]).index)].reset_index()
    return [
        ("verdict_counts", "How many hold", markup.table(counts, "Tests by paper and verdict")),
        (
            "claim_by_claim",
            "Claim by claim",
            markup.table(united(claims), "Each claim, with the verdicts of its tests"),
        ),
        ("claim_tests", "Every test", markup.folded(shown(claims), "claims", SHARED["claims"].description)),
    ]
