"""Advise which model gives the force of an instrument most exactly within a time, or within an error soonest."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import MARGIN, NONE
from palpate.benchmark.ranking import ALIKE, EQUAL, TIED_TIMES, TRUTH, first_of

COPIED = [
    "model", "setting", "force_error", "force_error_size", "rmse_of_peak", "patch_rms_of_peak", "online_median_s",
    "online_max_s", "preparation_s", "offline_s", "memory_mb", "samples",
]  # fmt: skip
"""Columns of touch.csv that advice has of a setting."""


def advise_touch(rows: pd.DataFrame, budget_ms: float | None = None, max_error: float | None = None) -> dict[str, Any]:
    """Return what to take of the ``rows`` of touch.csv about one scene, by the error of the force.

    Within a time [ms] that is what has the least limit of error and leaves MARGIN of it to the slowest touch; for an
    error it is the fastest whose limit is below. What failed on a touch, or gives no force, is not taken.
    The limit is the bound of nine answers in ten, where there is one, else the 95th percentile over the touches, in
    both cases with the truth's own error. Keys: scene, own, bounded (whether it is a bound), limit, the keys COPIED and
    why; ``model`` is NONE where nothing keeps what is asked, and ``nearest`` then has the same of what comes nearest.
    """
    truth = rows[rows["model"] == TRUTH]
    own = float(truth["force_error_p95"].max())
    able = rows[(rows["model"] != TRUTH) & (rows["failures"] == 0) & rows["force_error_size"].notna()]
    bound, p95 = able["force_error_bound"], able["force_error_p95"] + own
    able = able.assign(limit=bound.fillna(p95), bounded=bound.notna())
    limit, median, slowest = (able[name].to_numpy() for name in ("limit", "online_median_s", "online_max_s"))
    every = np.isfinite(limit)
    by_error = (limit, EQUAL), (median, TIED_TIMES), (able["memory_mb"].to_numpy(), ALIKE)
    found = {"scene": rows["scene"].iloc[0], "own": own, "budget_ms": budget_ms, "max_error": max_error}
    if max_error is None:
        fits = every if budget_ms is None else every & (1e3 * slowest <= (1.0 - MARGIN) * budget_ms)
        chosen, near = first_of(fits, *by_error), first_of(every, (slowest, 1.0))
        why = "it has the least limit of the error of the force" + (" of what answers in time" if budget_ms else "")
        lost = "nothing that gives a force answers in time, a fifth of it to spare"
    else:
        fits = every & (limit <= max_error)
        chosen, near = first_of(fits, (median, TIED_TIMES), (limit, EQUAL)), first_of(every, (limit, 1.0))
        why = "it is the fastest whose limit of the error of the force is below"
        lost = "no limit of the error of the force is below"
    if chosen is not None:
        return found | _copied(able.iloc[chosen]) | {"why": why}
    nearest = None if near is None else _copied(able.iloc[near])
    return found | {"model": NONE, "nearest": nearest, "why": lost if len(able) else "no model gives a force"}


def _copied(row: pd.Series) -> dict[str, Any]:
    return {name: row[name] for name in (*COPIED, "limit", "bounded")}
