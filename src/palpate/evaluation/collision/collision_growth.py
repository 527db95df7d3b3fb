"""What the table of collision's scaling says: how each stage grows with triangles."""

import numpy as np
import pandas as pd

STAGES = ("build_ms", "refit_ms", "query_ms")
FEWEST = 5000
"""Triangles from which on exponents are fitted: with fewer, what it takes to call the kernels shows in them."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Slopes of log time over log triangles from FEWEST triangles on: structure, depths, rival, one column a stage."""
    kept = table[table["triangles"] >= FEWEST]
    rows = []
    for (structure, depths, rival), group in kept.groupby(["structure", "depths", "rival"], sort=False, dropna=False):
        row = {"structure": structure, "depths": depths, "rival": rival}
        if len(group) > 1:
            count = np.log(group["triangles"])
            row |= {stage: np.polyfit(count, np.log(group[stage]), 1)[0] for stage in STAGES}
        rows.append(row)
    return pd.DataFrame(rows).reindex(columns=["structure", "depths", "rival", *STAGES])
