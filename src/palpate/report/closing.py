"""The parts that belong to no study: the claims of all papers, and limits and failures; and each study's own claims."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.report import declared, markup
from palpate.report.model_looks import plain
from palpate.report.report import Report
from palpate.report.template import Html, Part, Section, render

HERE = Path(__file__).parent
HEADS = {"premise": "tested on", "published": "the paper", "ours": "this run"}
"""The headings of columns whose names are no words for a page."""


def parts(
    report: Report, before: Iterable[Part], show: type[Html] = Html, left_out: Sequence[str] = ()
) -> dict[str, Part]:
    """Return the last parts of the page: claims, if a study reproduces a paper, and limits and failures.

    before : the parts of the studies; left_out : studies that the settings describe and this run does not compute
    """
    rendered = {}
    values_of = {"verdicts": verdicts(report), "limits": limits(report, before) | {"left_out": left_out}}
    for name, values in values_of.items():
        if values:
            html = show(report.figures, report.tables, declared.table)
            rendered[name] = render(HERE / f"{name}.md", name, values, html)
    return rendered


def limits(report: Report, before: Iterable[Part]) -> dict[str, Any]:
    """Return what the template of limits names."""
    failures = [(part.title, *failure) for part in before for failure in part.failures]
    failed = pd.DataFrame(failures, columns=["comparison", "what", "where", "how it failed"])
    return {
        "failed": failed,
        "papers": any(report.published.values()),
    }


def verdicts(report: Report) -> dict[str, Any]:
    """Return what the template of claims names; nothing if no study reproduces a paper."""
    claims = claims_of(report)
    if claims.empty:
        return {}
    counts = claims.groupby("paper")["verdict"].apply(counted).unstack(fill_value=0)
    return {
        "tests": len(claims),
        "claims": claims["claim"].nunique(),
        "verdicts": joined(counted(claims["verdict"])),
        "counts": counts[list(counted(claims["verdict"]).index)].reset_index(),
        "united": united(claims),
    }


def claims_of(report: Report, study: str = "") -> pd.DataFrame:
    """Return the claims of a study, or all; no rows if this run judges none."""
    table = report.tables.get("claims", declared.CLAIMS.frame([]))
    return table[table["study"] == study] if study else table


def shown(rows: pd.DataFrame) -> pd.DataFrame:
    """Return claims as the page shows them: models in words, the verdict where it is seen, and no study."""
    words = {name: rows[name].map(plain) for name in ("claim", "premise", "ours")}
    order = ["paper", "section", "claim", "verdict", "premise", "published", "ours"]
    return rows.assign(**words)[order].rename(columns=HEADS)


def united(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each claim: the number of its tests, and their common verdict, or each with its count."""
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


def joined(counts: pd.Series) -> str:
    """Join the counts of verdicts: "3 confirmed, 1 not testable"."""
    return ", ".join(f"{count} {word}" for word, count in counts.items())


def own_claims(report: Report, study: str) -> list[Section]:
    """Return the section about a study's own claims, closed at first as all claims stand at the end; or none."""
    rows = claims_of(report, study)
    if rows.empty:
        return []
    title = f"{len(rows)} tests of {rows['claim'].nunique()} claims: {joined(counted(rows['verdict']))}"
    caption = "What the paper says, what it was tested on here, and what this run measured"
    inner = markup.table(shown(rows).drop(columns="paper"), caption)
    return [(f"{study}_claims", "Claims, checked", markup.fold(title, inner))]
