"""List what is not in the report, and what failed in any part that offers ``failures``."""

import pandas as pd

from palpate.report import markup
from palpate.report.material import Report, Section

TITLE = "Limits and failures"
TABLES: dict = {}
COLUMNS = ("comparison", "what", "where", "how it failed")


def found(report: Report) -> pd.DataFrame:
    """Return everything that failed; rows of COLUMNS."""
    parts = [(name, part) for name, part in report.studies.items() if hasattr(part, "failures")]
    rows = [(part.TITLE, *row) for name, part in parts for row in part.failures(report.of(name))]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def numbers(report: Report) -> dict[str, str]:
    """Return the placeholders of this part, as text."""
    counts = found(report)["comparison"].value_counts(sort=False)
    phrases = ", ".join(f"{count} in “{name}”" for name, count in counts.items())
    return {"headline": f"Every failure is listed: {phrases}." if phrases else "Nothing failed."}


def sections(report: Report) -> list[Section]:
    """Return the list of every failure and, if a paper is repeated, what it leaves open."""
    failed = found(report)
    shown = markup.table(failed, "Every failure") if len(failed) else "<p>Nothing failed.</p>"
    failures = ("failures_section", "What failed", shown)
    if not any(report.published.values()):
        return [failures]
    return [("papers_section", "Numbers that the papers do not give", report.note("papers")), failures]
