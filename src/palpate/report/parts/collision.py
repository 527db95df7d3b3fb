"""Paper 3, chapter 4, in the report: bounding structures compared, how they grow, and what the paper says."""

from palpate.report import markup
from palpate.report.material import Report

TITLE = "Collision"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """A figure and its table each, and the paper's claims."""
    claims = markup.table(report.tables["collision_claims"], "Each claim of the paper, and what we measure")
    return [
        ("collision_section", "Bounding structures", report.figure("collision") + report.folded("collision")),
        (
            "collision_scaling_section",
            "Up to a million triangles",
            report.figure("collision_scaling") + report.folded("collision_scaling"),
        ),
        ("collision_claims_section", "The paper's composite tree", report.note("collision_claims") + claims),
    ]
