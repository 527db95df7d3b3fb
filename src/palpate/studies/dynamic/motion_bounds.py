"""Bound the error of a motion whose push is at a place that nobody measured: conformal, with places as the unit."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from palpate.benchmark.comparison import EXACT
from palpate.benchmark.conformal import Draws, bound_factor, finite
from palpate.benchmark.error_bounds import CONSTANT, OWN
from palpate.studies.dynamic.tables import TABLES

MEASURED = [
    "scene", "body", "contact", "model", "setting", "failures", "rmse_of_peak", "estimate_of_peak", "estimate_s",
    "peak_m", "reference_change",
]  # fmt: skip
"""The columns of what was measured at each place."""
COLUMNS = TABLES["motion_bounds"].columns.split()


def motion_bounds(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Tabulate motion_bounds.csv of tables with MEASURED: a row a scene, model, setting and estimate.

    A bound is a factor times the estimate, as in error_bounds.csv: nothing (``constant``), or what the model says of
    its own motion (``own``). A motion that failed has an infinite error.
    places, unresolved : how many places there are, and how many more whose reference was not resolved
    error_of_peak, bound_of_peak : medians over the places; factor and bound are of all places
    coverage, coverage_low, sharpness : at places held out, as ``coverage.Coverage``
    """
    rows = [row for table in tables for _, scene in table.groupby("scene", sort=False) for row in _of_scene(scene)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _of_scene(table: pd.DataFrame) -> list[dict]:
    known = table.dropna(subset="model")
    unresolved = table["contact"].nunique() - known["contact"].nunique()
    found = []
    for (model, setting), rows in known.groupby(["model", "setting"], sort=False):
        if len(rows) < known["contact"].nunique():  # the reference's last halvings, which the hard places alone have
            continue
        labels = {"scene": rows["scene"].iloc[0], "body": rows["body"].iloc[0], "model": model, "setting": setting}
        failures = int((rows["failures"] > 0).sum())
        labels |= {"places": len(rows), "unresolved": unresolved, "failures": failures}
        errors = rows["rmse_of_peak"].where(rows["failures"] == 0, np.inf).to_numpy()
        draws, place = Draws(rows["contact"].to_numpy()), rows["contact"].to_numpy()
        values = {CONSTANT: (np.ones(len(rows)), 0.0)}
        told = rows["estimate_of_peak"].to_numpy()
        if np.isfinite(told[np.isfinite(errors)]).all() and np.isfinite(told).any():
            values[OWN] = np.maximum(np.nan_to_num(told, nan=1.0), EXACT), float(rows["estimate_s"].median())
        for name, (value, seconds) in values.items():
            factor = finite(bound_factor(errors / value, place))
            told = {"estimate": name, "rank_correlation": _rank(errors, value), "error_of_peak": np.median(errors)}
            told |= {"bound_factor": factor, "bound_of_peak": factor * np.median(value), "estimate_s": seconds}
            with np.errstate(invalid="ignore"):  # how sharp an infinite bound of a failure is
                kept = draws.coverage(errors, value)
            told |= {key: getattr(kept, key) for key in ("sharpness", "coverage", "coverage_low")}
            found.append(labels | told)
    return found


def _rank(errors: np.ndarray, values: np.ndarray) -> float:
    """Return the rank correlation of errors and estimates; NaN where one of them is the same everywhere."""
    return float(spearmanr(errors, values).statistic) if np.ptp(values) > 0 and np.unique(errors).size > 1 else np.nan
