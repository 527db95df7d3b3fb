"""How cost and memory grow, in the report."""

from palpate.report.material import Report

TITLE = "How far it scales"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """The figure and its table."""
    return [("scaling_section", "Up to millions of elements", report.figure("scaling") + report.folded("scaling"))]
