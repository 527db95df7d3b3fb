"""What is not in the report, and what failed."""

from palpate.report import markup
from palpate.report.failures import failures
from palpate.report.material import Report

TITLE = "Omissions and failures"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """The written list, and every failure."""
    found = failures(report.tables)
    told = markup.table(found, "Everything that failed") if len(found) else "<p>Nothing failed.</p>"
    return [
        ("omissions_section", "What is left out", report.note("omissions")),
        ("failures_section", "What failed", told),
    ]
