"""Find the depth from which on a change of the law matters more than the mesh."""

import numpy as np
import pandas as pd

from palpate.studies.law.compare_laws import MESHES, OWN

VARIANT = ["body", "changed", "law", "poisson"]
COLUMNS = [*VARIANT, "contact", "mesh", "from_depth"]


def from_depths(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate, from law.csv, the depth from which on each change matters more than each mesh.

    Returns a row for each variant, contact and mesh, with COLUMNS: ``from_depth`` as a share of the body's size, 0
    where the change is larger at every depth that was pressed, infinite where it is not even at the largest. The mesh's
    error is that of the changed body against its own truth, and counts where that is believed; the mesh "own" is that
    truth, and its own error.
    """
    rows = []
    changed = table[(table["changed"] != OWN) & table["change_rmse_of_peak"].notna() & table["believed"].astype(bool)]
    for (*variant, contact), curve in changed.groupby([*VARIANT, "contact"], sort=False):
        for mesh in (*MESHES, "own"):
            known = curve[curve[f"{mesh}_rmse_of_peak"].notna()].sort_values("depth_of_size")
            if len(known):
                ends = known["depth_of_size"], known["change_rmse_of_peak"] / known[f"{mesh}_rmse_of_peak"]
                rows.append([*variant, contact, mesh, crossing(*(end.to_numpy() for end in ends))])
    return pd.DataFrame(rows, columns=COLUMNS)


def crossing(depth: np.ndarray, share: np.ndarray) -> float:
    """Return the depth from which on ``share`` (k,) stays above 1, over increasing ``depth`` (k,).

    Between two depths it is taken as a power of the depth. Returns 0 where it is above 1 at all depths, and infinity
    where it is not at the last one.
    """
    below = np.flatnonzero(~(share > 1.0))
    if not len(below):
        return 0.0
    i = int(below[-1])
    if i == len(depth) - 1:
        return float("inf")
    x, y = np.log(depth[i : i + 2]), np.log(np.maximum(share[i : i + 2], np.finfo(float).tiny))
    return float(np.exp(x[0] - y[0] * (x[1] - x[0]) / (y[1] - y[0])))
