"""Whether two runs found the same, but for what depends on how long something took."""

import re
from pathlib import Path

import pandas as pd

TIMED = re.compile(
    r"_s$|_ms$|_ns$|_ms_|^ms_|seconds|speedup|_kb$|_mb$|share_of_step|real_time_factor|exponent|break_even|margin|commit|threads"
)
"""Columns that hold times, or what follows from them."""
NOT_TIMES = {"time_s", "start_s"}
"""Columns of simulated time."""
VERDICTS = {"claims", "advice", "scaling", "error_bounds"}
"""Tables whose rows are worked out from times."""


def differences(one: Path, other: Path) -> list[str]:
    """One sentence for each table of ``one`` that ``other`` lacks or has otherwise; times are not compared."""
    tables = sorted(one.glob("*.csv"))
    if not tables:
        return [f"{one} has no tables"]
    return [said for path in tables if (said := _difference(path, other / path.name))]


def _difference(path: Path, copy: Path) -> str:
    if not copy.is_file():
        return f"{path.name} is missing"
    if path.stem in VERDICTS:
        return ""
    expected, found = pd.read_csv(path), pd.read_csv(copy)
    if list(expected) != list(found) or len(expected) != len(found):
        return f"{path.name}: other columns or another number of rows"
    kept = [name for name in expected if name in NOT_TIMES or not TIMED.search(name)]
    other = [name for name in kept if not expected[name].equals(found[name])]
    return f"{path.name}: {', '.join(other)}" if other else ""
