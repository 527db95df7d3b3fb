"""Numerical stability in the report: what became of every hard case, and what did not go as declared."""

from palpate.report import markup
from palpate.report.material import Report

TITLE = "Hard cases"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """The matrix and its table, then the outcomes other than stable with what was said."""
    table = report.tables["hard_cases"]
    told = table[table["outcome"] != "stable"]
    told = told.groupby(["case", "outcome", "declared"], sort=False).agg(
        models=("model", ", ".join), message=("message", "first")
    )
    caption = "Every outcome but stable, and what the first of its models said"
    return [
        ("hard_cases_section", "What became of them", report.figure("hard_cases") + report.folded("hard_cases")),
        ("hard_cases_told", "What was refused or not found", markup.table(told.reset_index(), caption)),
    ]
