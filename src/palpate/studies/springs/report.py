"""Report on paper 2: how well each method fits springs, how errors grow, and what springs can do at all."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.style import FORCES, look
from palpate.report.words import percent, seconds

TITLE = "Paper 2: spring parameters"
FITTED, OTHERS = 0.05, 0.15
"""RMSE of the peak up to which a fit is good, on its own press and on the others."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names; errors are medians over the seeds, as shares of the peak displacement."""
    fits, history, floor, errors = (report.tables[f"spring_{name}"] for name in ("fit", "history", "floor", "errors"))
    alone, helped = (tables.where(fits, volume_force=force) for force in (False, True))
    genetic, gradient = (tables.where(alone, method=name, used_in_fit=True) for name in ("genetic", "gradient"))
    largest = tables.where(errors, method="genetic", volume_force=False).groupby("press", sort=False)["most_m"].max()
    return {
        "generations": int(genetic["generations"].max()),
        "seconds_genetic": genetic["seconds"].median(),
        "ahead": 1.0 - gradient["fitness"].median() / np.median(genetic["fitness"]),
        "passed": {words: _passed(history, force) for force, words in FORCES.items()},
        "found": {words: _found(rows) for rows, words in ((alone, FORCES[False]), (helped, FORCES[True]))},
        "medians": _medians(fits),
        "errors": {look(name).label: _presses(alone, name) for name in ("uniform", "genetic", "gradient")},
        "largest_mm": {press: 1e3 * most for press, most in largest.items()},
        "zero_mm": 1e3 * errors["zero_m"].max(),
        "good": (FITTED, OTHERS),
        "met": _met(fits[~fits["method"].isin(["gradient_all"])]),
        "all": _presses(alone, "gradient_all"),
        "floor": {
            words: tables.where(floor, volume_force=force).groupby("poisson")["rmse_of_peak"].max().to_dict()
            for force, words in FORCES.items()
        },
    }


def _found(fits: pd.DataFrame) -> list[dict[str, Any]]:
    """Return fitness and time of each search."""
    rows = []
    for method in ("genetic", "cma_es", "gradient"):
        runs = tables.where(fits, method=method, used_in_fit=True)
        row = {"name": look(method).label, "seconds": runs["seconds"].median(), "seeds": runs["seed"].nunique()}
        rows.append(row | runs["fitness"].agg(median="median", least="min", most="max").to_dict())
    return rows


def _passed(history: pd.DataFrame, force: bool) -> float | None:
    """Return when [s] the gradient is better than the median of the genetic algorithm's ends; None if never."""
    runs = tables.where(history, volume_force=force)
    ends = tables.where(runs, method="genetic").groupby("seed")["fitness"].max()
    gradient = tables.where(runs, method="gradient")
    better = gradient[gradient["fitness"] > ends.median()]
    return float(better["seconds"].min()) if len(better) else None


def _presses(fits: pd.DataFrame, method: str) -> dict[str, float]:
    """Return the median error of each press."""
    return tables.where(fits, method=method).groupby("press", sort=False)["rmse_of_peak"].median().to_dict()


def _met(fits: pd.DataFrame) -> list[str]:
    """Name the methods whose median errors are small enough, with and without the volume force."""
    medians = fits.groupby(["volume_force", "method", "press", "used_in_fit"], sort=False)["rmse_of_peak"].median()
    bounds = [FITTED if used else OTHERS for used in medians.index.get_level_values("used_in_fit")]
    met = (medians <= bounds).groupby(level=["volume_force", "method"], sort=False).all()
    return [f"{look(method).label} ({FORCES[force]})" for force, method in met.index[met]]


def _medians(fits: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the median of the seeds and, where there are several, their range."""
    used = fits.groupby("press", sort=False)["used_in_fit"].mean()
    fitted, rows = set(used.index[used == used.max()]), []
    for (force, method), runs in fits.groupby(["volume_force", "method"], sort=False):
        row = {"forces": FORCES[force], "method": look(method).label}
        row |= {"time": seconds(runs[runs["used_in_fit"]].groupby("seed")["seconds"].first().median())}
        row |= {"fitness [m]": runs[runs["press"] == fits["press"].iloc[0]]["fitness"].median()}
        for press, found in runs.groupby("press", sort=False):
            row[f"{press} press{' (fitted)' if press in fitted else ''}"] = _spread(found["rmse_of_peak"])
        rows.append(row)
    return pd.DataFrame(rows)


def _spread(values: pd.Series) -> str:
    """Return the median, and the range if there are several values."""
    median, least, largest = map(percent, (values.median(), values.min(), values.max()))
    return median if len(values) == 1 else f"{median} [{least}, {largest}]"
