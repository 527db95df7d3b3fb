"""Report numerical stability: the outcome of every hard case, and what did not go as declared."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import named
from palpate.report.report import Report
from palpate.report.words import spaced

TITLE = "Hard cases"
WORDS = {"nan": "not a number", "not_converged": "not converged"}
"""Outcomes whose names are not words."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    table = report.tables["hard_cases"]
    passed, bad = table["passed"].astype(bool), table["outcome"].isin(["wrong", "nan"])
    sharp = table.loc[table["outcome"] == "stable", "sharp"].astype(str)
    # whatever numbers and names of models they contain
    reasons = table.loc[table["value"].isna(), "message"].fillna("").astype(str)
    locked = tables.where(table, case="locking").set_index("model")["value"]
    return {
        "cases": table["case"].nunique(),
        "runs": len(table),
        "bad": int(bad.sum()),
        "known": int((bad & passed).sum()),
        "undeclared": int((~passed).sum()),
        "answers": int(table["value"].notna().sum()),
        "reasons": int(reasons.str.replace(r"[-+.\de]*\d", "0", regex=True).nunique()),
        "sharp": int((sharp == "True").sum()),
        "sharper": int((table["twentieth"] > table["bound"])[table["outcome"] == "stable"].sum()),
        "stable": len(sharp),
        "outcomes": {_outcome(name): number for name, number in table["outcome"].value_counts().items()},
        "locking": {spaced(str(name)): share for name, share in locked.items()},
        "refusals": _refusals(table),
    }


def _outcome(name: str) -> str:
    return WORDS.get(name, spaced(name))


def _declared(outcomes: str) -> str:
    return " or ".join(_outcome(name.strip()) for name in str(outcomes).split(" or "))


def _refusals(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate every outcome but stable: a case, its models, and the reason that the first of them gives."""
    given = table[table["outcome"] != "stable"].assign(
        case=table["case"].map(spaced), model=table["model"].map(named), outcome=table["outcome"].map(_outcome)
    )
    groups = given.groupby(["case", "outcome", "declared"], sort=False)
    found = groups.agg(
        models=("model", lambda few: ", ".join(few) if len(few) <= 4 else f"all {len(few)} that were tried"),
        reason=("message", "first"),
    )
    return found.reset_index().assign(declared=lambda rows: rows["declared"].map(_declared))


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the runs that ended otherwise than declared: what, where, how. A declared refusal is no failure."""
    table = report.tables["hard_cases"]
    for row in table[~table["passed"].astype(bool)].itertuples():
        yield named(row.model), spaced(row.case), f"{_outcome(row.outcome)}; declared: {_declared(row.declared)}"
