"""Exponents of collision_scaling.csv: the growth of each stage with the number of triangles."""

import numpy as np
import pandas as pd

STAGES = ("build_ms", "refit_ms", "query_ms")
FEWEST = 5000
"""Least number of triangles for the fit of exponents: below it the cost of calling compiled functions matters."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the slopes of log time over log triangles, from FEWEST triangles on.

    The columns are structure, depths, rival and one for each of STAGES.
    """
    kept = table[table["triangles"] >= FEWEST]
    rows = []
    for (structure, depths, rival), group in kept.groupby(["structure", "depths", "rival"], sort=False, dropna=False):
        row = {"structure": structure, "depths": depths, "rival": rival}
        if len(group) > 1:
            count = np.log(group["triangles"])
            row |= {stage: np.polyfit(count, np.log(group[stage]), 1)[0] for stage in STAGES}
        rows.append(row)
    return pd.DataFrame(rows).reindex(columns=["structure", "depths", "rival", *STAGES])
