"""Prepare the rows of one scene for a diagram: the mean of the splits, the truth's own error, families of models."""

import numpy as np
import pandas as pd

from palpate.benchmark.ranking import BOUNDS, EXACT, alone, lasting, own_error
from palpate.models.model_registry import FAMILY_OF

KNOWN = 0.003
"""Own error [of the peak] above which a truth is said not to be known well."""
JUMP = 2.0
"""A step that moves the body so many times as far as the one before is a jump."""


def answers(settings: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of models that answer something: neither the truth's nor the zero answer's."""
    return settings[~settings["model"].isin(BOUNDS)]


def whole(settings: pd.DataFrame) -> pd.Series:
    """Return which settings have answered every test and validation sample; what has not is never advised."""
    return (settings["failures"] == 0) & settings["validation_rmse_of_peak"].notna()


def curves(settings: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Divide the rows of one scene into those of each curve: of each model, and of the variants of one together."""
    names = settings["model"].map(lambda model: FAMILY_OF.get(model, model))
    return dict(iter(settings.groupby(names, sort=False)))


def front_rows(settings: pd.DataFrame, column: str = "rmse_of_peak") -> pd.DataFrame:
    """Select the settings of one scene that stay on the front in other runs, fastest first, one of equal ones.

    column : the error that counts, on test samples; below the truth's own, errors are tied. What failed on a sample,
    a validation one too, is left out, as it is never advised
    """
    truth_own = own_error(settings, column)
    floor = max(truth_own, EXACT) if truth_own > 0 else EXACT
    answered = answers(settings[whole(settings)])
    answered = answered.assign(rmse_of_peak=answered[column])
    lasting_rows = answered[lasting(answered["online_median_s"], answered["rmse_of_peak"], floor)]
    rows = [alone(of_model, floor) for _, of_model in lasting_rows.groupby("model", sort=False)]
    front = pd.concat(rows).sort_values("online_median_s") if rows else lasting_rows
    return settings.loc[front.index]


def jumps(table: pd.DataFrame) -> pd.DataFrame:
    """Return the steps of ``table``, of ``limit_points``, in which a body jumps or its equilibrium is lost.

    Columns: body, contact, pressure_of_young before and after, peak_of_size before and after, least_det after.
    """
    rows = []
    for (body, contact), curve in table.groupby(["body", "contact"], sort=False):
        pressure, peak = curve["pressure_of_young"].to_numpy(), curve["peak_of_size"].to_numpy()
        slopes = np.diff(peak, prepend=0.0) / np.diff(pressure, prepend=0.0)
        for i in range(1, len(curve)):
            if not curve["converged"].iloc[i] or slopes[i] > JUMP * slopes[i - 1]:
                least_det = curve["least_det"].iloc[i]
                rows.append([body, contact, pressure[i - 1], pressure[i], peak[i - 1], peak[i], least_det])
    ends = [f"{name}_{end}" for name in ("pressure_of_young", "peak_of_size") for end in ("before", "after")]
    return pd.DataFrame(rows, columns=["body", "contact", *ends, "least_det"])
