"""The numbers that the captions and the headline about hard cases name, worked out from their table."""

import pandas as pd

from palpate.figures import tables


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Every placeholder of these captions, as text."""
    table = all_tables["hard_cases"]
    counts = table["outcome"].value_counts()
    undeclared = int((~table["passed"].astype(bool)).sum())
    cases = f"{table['case'].nunique()} hard cases, {len(table)} runs"
    bad = int(counts.get("wrong", 0) + counts.get("nan", 0))
    return {
        "headline_hard_cases": (
            f"{cases}: {bad} wrong or not a number; {undeclared or 'none'} went otherwise than declared beforehand."
        ),
        "hard_cases_count": cases,
        "hard_cases_outcomes": ", ".join(f"{number} {name.replace('_', ' ')}" for name, number in counts.items()),
        "hard_cases_undeclared": str(undeclared),
        "hard_cases_locking": _locking(table),
    }


def _locking(table: pd.DataFrame) -> str:
    """What linear tetrahedra lack of a deflection at ν = 0.4999, by level and with 0.45 in its place."""
    shares = tables.where(table, case="locking").set_index("model")["value"]
    return (
        ", ".join(f"{100 * share:.0f}\u00a0% {name.replace('_', ' ')}" for name, share in shares.items()) or "not run"
    )
