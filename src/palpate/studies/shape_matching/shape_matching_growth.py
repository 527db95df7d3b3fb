"""Results from shape_matching_timing.csv: the headline case, and the growth of the cost with particles."""

from typing import Any

import numpy as np
import pandas as pd

HEADLINE: dict[str, Any] = {"particles": 100, "clusters": 8, "mode": "quadratic", "objects": 100}
"""The case that the thesis ran at 50 steps a second."""

FEWEST = 3000
"""Least number of particles for the fit of exponents: below it the cost of calling compiled functions matters."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the slope of log ms_per_step over log all_particles for objects of 100 particles.

    The columns are mode, clusters and exponent.
    """
    kept = table[(table["particles"] == 100) & (table["all_particles"] >= FEWEST)]
    rows = []
    for (mode, clusters), group in kept.groupby(["mode", "clusters"], sort=False):
        slope = np.polyfit(np.log(group["all_particles"]), np.log(group["ms_per_step"]), 1)[0]
        rows.append({"mode": mode, "clusters": clusters, "exponent": slope})
    return pd.DataFrame(rows)


def headline(table: pd.DataFrame) -> float:
    """Look up the milliseconds of a step of 100 objects of 100 particles in 8 quadratic clusters each."""
    rows = table
    for column, value in HEADLINE.items():
        rows = rows[rows[column] == value]
    return float(rows["ms_per_step"].iloc[0])
