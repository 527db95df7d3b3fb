"""Judge what a paper claims by what this run measured: the rows that parts of the report offer as ``claims``."""

from collections.abc import Iterator

import pandas as pd

from palpate.report.words import plain

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "cannot be compared"
COLUMNS = ("paper", "claim", "the paper", "this run", "verdict")

Claim = tuple[str, str, str, str, str]
"""A row of COLUMNS."""


def verdict(holds: bool) -> str:
    """Return the verdict on a claim that can be compared."""
    return CONFIRMED if holds else REFUTED


def tabulated(paper: str, table: pd.DataFrame) -> Iterator[Claim]:
    """Yield the claims of a table of claims, such as claims.csv, with models in words."""
    for row in table.itertuples(index=False):
        yield paper, plain(row.claim), row.paper, plain(row.measured), row.verdict
