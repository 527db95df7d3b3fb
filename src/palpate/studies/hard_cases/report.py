"""Put the outcomes of hard cases into words, and gather those without a right answer."""

from typing import Any

import pandas as pd

from palpate.report.model_looks import named
from palpate.report.report import Report
from palpate.report.words import spaced

WORDS = {"nan": "not a number", "not_converged": "not converged"}
"""Outcomes whose names are not words."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names: the table in words, and its runs without a right answer."""
    table = report.tables["hard_cases"]
    in_words = table.assign(
        case=table["case"].map(spaced), model=table["model"].map(named), outcome=table["outcome"].map(_outcome),
        declared=[" or ".join(map(_outcome, str(outcomes).split(" or "))) for outcomes in table["declared"]],
        passed=table["passed"].astype(bool), sharp=table["sharp"].astype(str),
    )  # fmt: skip
    return {"hard_cases": in_words, "refusals": _refusals(in_words[in_words["outcome"] != "stable"])}


def _outcome(name: str) -> str:
    return WORDS.get(name.strip(), spaced(name.strip()))


def _refusals(not_stable: pd.DataFrame) -> pd.DataFrame:
    """Tabulate every outcome but stable: a case, its models, and the reason that the first of them gives."""
    refusals = not_stable.groupby(["case", "outcome", "declared"], sort=False).agg(
        models=("model", lambda names: ", ".join(names) if len(names) <= 4 else f"all {len(names)} that were tried"),
        reason=("message", "first"),
    )
    return refusals.reset_index()
