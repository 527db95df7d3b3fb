"""Show the rows of claims.csv: in the part of the study that judges them, and claim by claim."""

import pandas as pd

from palpate.report import markup
from palpate.report.material import Report, Section
from palpate.report.names import plain
from palpate.report.table import columns

HEADS = {"premise": "tested on", "published": "the paper", "ours": "this run"}
"""The headings of columns whose names are no words for a page."""


def found(report: Report, study: str = "") -> pd.DataFrame:
    """Return the claims of a study, or all; no rows if this run judges none."""
    table = report.tables.get("claims", pd.DataFrame(columns=columns("claims")))
    return table[table["study"] == study] if study else table


def shown(rows: pd.DataFrame) -> pd.DataFrame:
    """Return claims as the page shows them: models in words, the verdict where it is seen, and no study."""
    words = {name: rows[name].map(plain) for name in ("claim", "premise", "ours")}
    order = ["paper", "section", "claim", "verdict", "premise", "published", "ours"]
    return rows.assign(**words)[order].rename(columns=HEADS)


def united(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each claim: the number of its tests, and their verdict, or how many have which."""
    groups = rows.groupby(["paper", "section", "claim", "published"], sort=False)["verdict"]
    table = groups.agg(tests="size", verdict=_verdict).reset_index()
    return table.assign(claim=table["claim"].map(plain)).rename(columns=HEADS)


def _verdict(verdicts: pd.Series) -> str:
    """Return the verdict that all have in common, or each with its count: "confirmed (2), refuted (1)"."""
    if verdicts.nunique() == 1:
        return verdicts.iloc[0]
    return ", ".join(f"{word} ({count})" for word, count in counted(verdicts).items())


def counted(verdicts: pd.Series) -> pd.Series:
    """Count verdicts; the reasons of what cannot be tested are left out."""
    return verdicts.str.split(":").str[0].value_counts()


def said(counts: pd.Series) -> str:
    """Join the counts of verdicts: "3 confirmed, 1 not testable"."""
    return ", ".join(f"{count} {word}" for word, count in counts.items())


def section(report: Report, study: str) -> list[Section]:
    """Return the section about a study's own claims, closed at first as all claims stand at the end; or none."""
    rows = found(report, study)
    if rows.empty:
        return []
    title = f"{len(rows)} tests of {rows['claim'].nunique()} claims: {said(counted(rows['verdict']))}"
    about = "What the paper says, what it was tested on here, and what this run measured"
    return [
        (
            f"{study}_claims",
            "Claims, checked",
            markup.fold(title, markup.table(shown(rows).drop(columns="paper"), about)),
        )
    ]
