"""List the papers' claims, confirmed or refuted, of all parts that offer ``claims``: one table."""

import pandas as pd

from palpate.report import markup
from palpate.report.material import Report, Section
from palpate.report.paper_claims import COLUMNS, CONFIRMED, REFUTED

TITLE = "The papers' claims, checked"
TABLES: dict = {}


def found(report: Report) -> pd.DataFrame:
    """Return all claims; rows of COLUMNS."""
    parts = [(name, part) for name, part in report.studies.items() if hasattr(part, "claims")]
    return pd.DataFrame([row for name, part in parts for row in part.claims(report.of(name))], columns=list(COLUMNS))


def numbers(report: Report) -> dict[str, str]:
    """Return the placeholders of this part, as text."""
    counts = found(report)["verdict"].value_counts()
    others = "".join(f"; {n} {word}" for word, n in counts.items() if word not in (CONFIRMED, REFUTED))
    if counts.empty:
        return {}
    return {
        "headline": f"Of {counts.sum()} claims that the papers make, {counts.get(CONFIRMED, 0)} are confirmed and "
        f"{counts.get(REFUTED, 0)} are refuted{others}."
    }


def sections(report: Report) -> list[Section]:
    """Return one table of all claims; none if no study reproduces a paper."""
    claims = found(report)
    if claims.empty:
        return []
    return [("claim_by_claim", "Claim by claim", markup.table(claims, "Each claim, and what this run measured"))]
