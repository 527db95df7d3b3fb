"""Exponents of scaling.csv: the growth of each component's time and memory with its size."""

import numpy as np
import pandas as pd

LARGEST = 4
"""Number of largest sizes over which an exponent is fitted: at smaller ones the cost of the call itself matters."""
LEAST_MB = 10.0
"""Least memory [MB] that is considered: less is hidden in the memory that the process already had."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the slopes of log seconds and log memory over log size.

    The columns are component, stage, seconds_exponent and memory_exponent; NaN where there are fewer than two sizes.
    """
    rows = []
    for (component, stage), group in table.groupby(["component", "stage"], sort=False):
        largest = group.sort_values("size").tail(LARGEST)
        held = largest[largest["memory_mb"] >= LEAST_MB]
        rows.append((component, stage, _slope(largest, "seconds"), _slope(held, "memory_mb")))
    return pd.DataFrame(rows, columns=["component", "stage", "seconds_exponent", "memory_exponent"])


def _slope(group: pd.DataFrame, column: str) -> float:
    if group["size"].nunique() < 2:
        return np.nan
    return float(np.polyfit(np.log(group["size"]), np.log(group[column]), 1)[0])
