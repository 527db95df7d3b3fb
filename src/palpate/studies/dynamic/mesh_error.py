"""Tell how wrong the mesh of a reference of motion is itself, as far as presses of the same body show it."""

from typing import NamedTuple

import pandas as pd

MODEL = "fem_p1"
"""The elements of the reference, among the models of accuracy_vs_time.csv."""


class MeshError(NamedTuple):
    """Least and largest mean error of a level over the regimes of a body, of the peak: everywhere, at the patch."""

    low: float
    high: float
    patch_low: float
    patch_high: float


def mesh_error(pressed: pd.DataFrame | None, body: str, level: int) -> MeshError | None:
    """Return the error of converged linear elements of a level against the truth of presses, None if it is not known.

    pressed : accuracy_vs_time.csv, None if there is none
    """
    if pressed is None:
        return None
    rows = pressed[(pressed["model"] == MODEL) & (pressed["body"] == body)]
    rows = rows[rows["setting"].str.startswith(f"level={level}, ")]
    exact = rows["setting"].str.extract(r"tolerance=([0-9.e+-]+)", expand=False).astype(float)
    rows = rows[exact == exact.min()]
    if rows.empty:
        return None
    means = rows.groupby("scene")[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    surface, patch = means["rmse_of_peak"], means["patch_rms_of_peak"]
    return MeshError(surface.min(), surface.max(), patch.min(), patch.max())
