"""What the table of scaling says: with which power of its size each kernel's cost and memory grow."""

import numpy as np
import pandas as pd

LARGEST = 4
"""Sizes over which a power is fitted, the largest there are: smaller ones tell what it takes to call the kernel."""
LEAST_MB = 10.0
"""Memory that is looked at: less than that hides in what the process had before."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Slopes of log seconds and log memory over log size: kernel, stage, seconds_exponent, memory_exponent.

    NaN where fewer than two sizes tell.
    """
    rows = []
    for (kernel, stage), group in table.groupby(["kernel", "stage"], sort=False):
        largest = group.sort_values("size").tail(LARGEST)
        held = largest[largest["memory_mb"] >= LEAST_MB]
        rows.append((kernel, stage, _slope(largest, "seconds"), _slope(held, "memory_mb")))
    return pd.DataFrame(rows, columns=["kernel", "stage", "seconds_exponent", "memory_exponent"])


def _slope(group: pd.DataFrame, column: str) -> float:
    if group["size"].nunique() < 2:
        return np.nan
    return float(np.polyfit(np.log(group["size"]), np.log(group[column]), 1)[0])
