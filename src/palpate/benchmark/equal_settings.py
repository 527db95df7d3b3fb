"""Decide when two settings count as equal, so that another run of the same measurement comes to the same choice."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

CLOSE = 1.5
"""Times within this factor are tied: medians that repeat within 20 % each can change their ratio by 1.2²."""
EQUAL = 1.05
"""Errors within this factor are tied: they repeat bit for bit, but such a difference decides nothing."""
EXACT = 1e-5
"""Errors below this share of the peak are tied with it: nobody could measure them."""
ALIKE = 1.1
"""Memory within this factor is tied."""

KINDS = {"rms": "rmse_of_peak", "patch": "patch_rms_of_peak"}
"""The kinds of error that advice goes by, and their columns: over the whole surface, or where it is pressed."""


def by_error(column: str) -> dict[str, float]:
    """Return what decides, in turn, between settings of which the least error is wanted; ``column`` has the errors."""
    return {column: EQUAL, "online_median_s": CLOSE, "memory_mb": ALIKE}


def by_time(column: str) -> dict[str, float]:
    """Return what decides, in turn, between settings of which the fastest is wanted; ``column`` has the errors."""
    return {"online_median_s": CLOSE, column: EQUAL, "memory_mb": ALIKE}


BY_ERROR, BY_TIME = by_error("rmse_of_peak"), by_time("rmse_of_peak")


def pick(rows: pd.DataFrame, by: Mapping[str, float], floor: float = EXACT) -> pd.Series:
    """Return the row that is left when each column in turn keeps what is within a factor of its least value.

    floor : errors below it are tied with it: that of the truth itself
    Where several are left, the first of the table.
    """
    for column, factor in by.items():
        values = rows[column].clip(lower=floor if column.endswith("of_peak") else 0)
        rows = rows[values <= factor * values.min()]
    return rows.iloc[0]


def lasting(seconds: np.ndarray, error: np.ndarray, floor: float = EXACT) -> np.ndarray:
    """Mark which points (n,) of a Pareto front are on it in another run too, as truth values (n,).

    A point is left out if another is clearly less wrong in no longer a time, ties counted, or clearly faster and no
    more wrong, ties counted; one that is not finite is never on it. Errors below ``floor`` are tied with it.
    Trap: a point may be left out for one that is left out for a third; the exact front is ``figures.pareto.front``.
    """
    seconds, error = np.asarray(seconds, float), np.asarray(error, float)
    t, e = np.where(np.isfinite(seconds + error), [seconds, np.maximum(error, floor)], np.inf)
    less_wrong = (t[None] <= CLOSE * t[:, None]) & (EQUAL * e[None] < e[:, None])
    faster = (CLOSE * t[None] < t[:, None]) & (e[None] <= EQUAL * e[:, None])
    return np.isfinite(t) & ~(less_wrong | faster).any(axis=1)


def alone(rows: pd.DataFrame, floor: float = EXACT) -> pd.DataFrame:
    """Drop the rows that are tied in error and time with one before them; errors below ``floor`` are."""
    error, seconds = rows["rmse_of_peak"].clip(lower=floor).to_numpy(), rows["online_median_s"].to_numpy()
    kept: list[int] = []
    for i in range(len(rows)):
        far = [max(error[i], error[j]) > EQUAL * min(error[i], error[j]) for j in kept]
        slow = [max(seconds[i], seconds[j]) > CLOSE * min(seconds[i], seconds[j]) for j in kept]
        if all(f or s for f, s in zip(far, slow, strict=True)):
            kept.append(i)
    return rows.iloc[kept]
