"""What the table of shape matching's cost says: the headline, and how the cost grows with particles."""

import numpy as np
import pandas as pd

HEADLINE = {"particles": 100, "clusters": 8, "mode": "quadratic", "objects": 100}
"""What the thesis ran at 50 steps a second."""

FEWEST = 3000
"""Particles from which on the exponent is fitted: with fewer, what it takes to call the kernels shows in it."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Slope of log ms_per_step over log all_particles, for objects of 100 particles: mode, clusters, exponent."""
    kept = table[(table["particles"] == 100) & (table["all_particles"] >= FEWEST)]
    rows = []
    for (mode, clusters), group in kept.groupby(["mode", "clusters"], sort=False):
        slope = np.polyfit(np.log(group["all_particles"]), np.log(group["ms_per_step"]), 1)[0]
        rows.append({"mode": mode, "clusters": clusters, "exponent": slope})
    return pd.DataFrame(rows)


def headline(table: pd.DataFrame) -> float:
    """Milliseconds of a step of 100 objects of 100 particles in 8 quadratic clusters each."""
    rows = table
    for column, value in HEADLINE.items():
        rows = rows[rows[column] == value]
    return float(rows["ms_per_step"].iloc[0])
