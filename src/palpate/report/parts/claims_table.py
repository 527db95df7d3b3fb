"""The papers' claims in the report: all of them in one table, confirmed or refuted."""

from palpate.report import markup
from palpate.report.material import Report
from palpate.report.paper_claims import verdicts

TITLE = "Three papers' claims, checked"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """One table of all claims; the parts that follow have the figures behind them."""
    claims = verdicts(report.tables, report.published)
    return [("verdicts_section", "Claim by claim", markup.table(claims, "Each claim, and what we measure"))]
