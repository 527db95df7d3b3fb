"""Compare the tables of two results folders, times apart, where names have changed in between.

python tests/tools/compare_results.py BEFORE/results AFTER/results
"""

import re
import sys
from pathlib import Path

import pandas as pd

COLUMNS = {
    "knob": "setting",
    "rival_knob": "rival_setting",
    "kernel": "component",
    "ours": "measured",
}
"""Columns that were renamed after commit 1f2d5e4."""
DROPPED = {"slower_than_life"}
"""Columns that hold times and were replaced by others."""
CORRECTION = {f"ours{ending}": f"detail_correction{ending}" for ending in ("", "_unturned", "_untaught")}
VALUES = {"model": CORRECTION, "method": CORRECTION, "family": {"kernel": "enrichment"}}
"""Values that were renamed after that commit, by column."""
REWORDED = {"hard_cases": {"scene", "measure", "message", "source"}, "scene_effects": {"reason"}}
"""Columns of prose, whose words changed, by table."""
LINEAR = re.compile(r"coarse=linear(, )?")
"""Settings of the model ``ours`` that are those of ``warped_compliance`` now."""
TIMED = re.compile(
    r"_s$|_ms$|_ns$|_ms_|^ms_|seconds|speedup|_kb$|_mb$|share_of_step|real_time_factor|exponent|break_even|margin|commit|threads"
)
"""Columns that hold times or memory, or what follows from them."""
NOT_TIMES = {"time_s", "start_s"}
"""Columns of simulated time."""
FROM_TIMES = {
    "claims", "advice", "advice_agreement", "advice_by_radius", "scaling", "complexity",
    "collision_scaling", "online_cost", "error_bounds",
}  # fmt: skip
"""Tables whose rows are worked out from times: only that they are there is compared."""


def renamed(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of the earlier commit with the names of today."""
    table = table.drop(columns=[name for name in DROPPED if name in table]).rename(columns=COLUMNS)
    if {"model", "setting"} <= set(table):
        linear = table["model"].eq("ours") & table["setting"].str.contains(LINEAR.pattern.split("(")[0])
        table["model"] = table["model"].mask(linear, "warped_compliance")
        table["setting"] = table["setting"].mask(linear, table["setting"].str.replace(LINEAR, "", regex=True))
    for column, names in VALUES.items():
        if column in table:
            table[column] = table[column].replace(names)
    return table


def difference(before: Path, after: Path) -> str:
    """Return what differs between two tables in a sentence; nothing if they are the same, times apart."""
    if not after.is_file():
        return f"{before.name} is missing"
    if before.stem in FROM_TIMES:
        return ""
    expected, found = renamed(pd.read_csv(before)), pd.read_csv(after)
    counted = [name for name in expected if name not in REWORDED.get(before.stem, ())]
    kept = [name for name in counted if name in NOT_TIMES or not TIMED.search(name)]
    if missing := [name for name in kept if name not in found]:
        return f"{before.name} lacks the columns {', '.join(missing)}"
    if len(expected) != len(found):
        return f"{before.name} has {len(found)} rows instead of {len(expected)}"
    texts = [name for name in kept if not pd.api.types.is_numeric_dtype(expected[name])]
    expected, found = (
        table.sort_values([*texts, *kept], kind="stable", ignore_index=True) for table in (expected, found)
    )
    other = [name for name in kept if not expected[name].equals(found[name])]
    return f"{before.name} differs in {', '.join(other)}" if other else ""


def main(before: str, after: str) -> int:
    """Print what differs, a line a table; return the number of tables that do."""
    tables = sorted(Path(before, "tables").glob("*.csv"))
    found = [text for path in tables if (text := difference(path, Path(after, "tables", path.name)))]
    print("\n".join(found or [f"{len(tables)} tables are the same, times apart."]))
    return len(found) or not tables


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
