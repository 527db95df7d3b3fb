"""Report numerical stability: the outcome of every hard case, and what did not go as declared."""

from collections.abc import Iterator

import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.names import named
from palpate.report.words import spaced
from palpate.studies.hard_cases.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "Hard cases"
WORDS = {"nan": "not a number", "not_converged": "not converged"}
"""Outcomes whose names are not words."""


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    table = report.tables["hard_cases"]
    counts = table["outcome"].value_counts()
    undeclared = int((~table["passed"].astype(bool)).sum())
    cases = f"{table['case'].nunique()} hard cases in {len(table)} runs"
    bad = table["outcome"].isin(["wrong", "nan"])
    known = int((bad & table["passed"].astype(bool)).sum())
    wrong = f"{bad.sum()} gave a wrong answer, {known} of them a known one" if bad.any() else "none gave a wrong answer"
    surprises = f"{undeclared} ended otherwise than declared" if undeclared else "every one ended as declared"
    return {
        "headline": f"{cases}: {wrong}, and {surprises} beforehand.",
        "hard_cases_answers": str(int(table["value"].notna().sum())),
        "hard_cases_reasons": str(_reasons(table)),
        "hard_cases_sharp": _sharp(table),
        "hard_cases_count": cases,
        "hard_cases_outcomes": ", ".join(f"{number} {_outcome(name)}" for name, number in counts.items()),
        "hard_cases_undeclared": str(undeclared or "none"),
        "hard_cases_locking": _locking(table),
    }


def _outcome(name: str) -> str:
    return WORDS.get(name, spaced(name))


def _reasons(table: pd.DataFrame) -> int:
    """Count the different reasons of runs without an answer, whatever numbers and names of models they contain."""
    given = table.loc[table["value"].isna(), "message"].fillna("").astype(str)
    return int(given.str.replace(r"[-+.\de]*\d", "0", regex=True).nunique())


def _sharp(table: pd.DataFrame) -> str:
    """Return how many bounds fail all wrong answers, of those that an answer is within."""
    sharp = table.loc[table["outcome"] == "stable", "sharp"].astype(str)
    return f"{int((sharp == 'True').sum())} of {len(sharp)}"


def _locking(table: pd.DataFrame) -> str:
    """Return what elements miss of a deflection at ν = 0.4999, by level, with 0.45 in its place, and quadratic ones."""
    shares = tables.where(table, case="locking").set_index("model")["value"]
    return ", ".join(f"{100 * share:.0f}\u00a0% ({spaced(name)})" for name, share in shares.items()) or "not run"


def sections(report: Report) -> list[Section]:
    """Return the matrix and its table, with the reasons of those that gave no answer."""
    table = report.tables["hard_cases"]
    given = table[table["outcome"] != "stable"].assign(
        case=table["case"].map(spaced), model=table["model"].map(named), outcome=table["outcome"].map(_outcome)
    )
    given = given.groupby(["case", "outcome", "declared"], sort=False).agg(
        models=("model", _names), reason=("message", "first")
    )
    given = given.reset_index().assign(declared=lambda rows: rows["declared"].map(_declared))
    reasons = markup.fold(
        f"Runs without a right answer: {len(table) - int((table['outcome'] == 'stable').sum())}, with the reason given",
        markup.table(given, "Every outcome but stable, and the reason that the first of its models gives"),
    )
    return [("hard_cases_section", "Outcomes", report.figure("hard_cases") + reasons + report.folded("hard_cases"))]


def _names(models: pd.Series) -> str:
    """Name a few models, or count many."""
    return ", ".join(models) if len(models) <= 4 else f"all {len(models)} that were tried"


def _declared(outcomes: str) -> str:
    return " or ".join(_outcome(name.strip()) for name in str(outcomes).split(" or "))


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the runs that ended otherwise than declared: what, where, how. A declared refusal is no failure."""
    table = report.tables["hard_cases"]
    for row in table[~table["passed"].astype(bool)].itertuples():
        yield named(row.model), spaced(row.case), f"{_outcome(row.outcome)}; declared: {_declared(row.declared)}"
