"""Compare the tables of two results folders, times excepted.

python tests/tools/compare_results.py BEFORE/results AFTER/results
"""

import re
import sys
from pathlib import Path

import pandas as pd

TIMED = re.compile(
    r"_s$|_ms$|_ns$|_ms_|^ms_|seconds|speedup|_kb$|_mb$|share_of_step|real_time_factor|exponent|break_even|margin|commit|threads"
)
"""Columns that hold times or memory, or what follows from them."""
NOT_TIMES = {"time_s", "start_s"}
"""Columns of simulated time."""
FROM_TIMES = {
    "claims", "advice", "scaling", "complexity",
    "collision_scaling", "online_cost", "error_bounds",
}  # fmt: skip
"""Tables whose rows are worked out from times: only that they are there is compared."""
WITHIN_BUDGET = "budget_ms="
"""In settings that leave out what has taken too long: their answers follow from times."""


def differences(before: Path, after: Path) -> list[str]:
    """Return a sentence for each table of the folder ``before`` that ``after`` lacks or has otherwise."""
    tables = sorted(before.glob("*.csv"))
    if not tables:
        return [f"{before} has no tables"]
    return [said for path in tables if (said := _difference(path, after / path.name))]


def _difference(path: Path, copy: Path) -> str:
    if not copy.is_file():
        return f"{path.name} is missing"
    if path.stem in FROM_TIMES:
        return ""
    expected, found = pd.read_csv(path), pd.read_csv(copy)
    if list(expected) != list(found) or len(expected) != len(found):
        return f"{path.name}: other columns or another number of rows"
    if "setting" in expected:
        free = ~expected["setting"].astype(str).str.contains(WITHIN_BUDGET, regex=False)
        expected, found = expected[free], found[free]
    kept = [name for name in expected if name in NOT_TIMES or not TIMED.search(name)]
    other = [name for name in kept if not expected[name].equals(found[name])]
    return f"{path.name}: {', '.join(other)}" if other else ""


if __name__ == "__main__":
    found = differences(*(Path(results, "tables") for results in sys.argv[1:]))
    print("\n".join(found or ["the tables are the same, times apart."]))
    sys.exit(len(found))
