"""Compute what the report says of paper 2's springs beside its tables: who is ahead, and whose errors are small."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import FORCES, look
from palpate.report.report import Report
from palpate.report.words import percent, seconds
from palpate.studies.springs.claims import as_fit_after

FITTED, OTHERS = 0.05, 0.15
"""RMSE of the peak up to which a fit is good, on its own press and on the others."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names; errors are medians over the seeds, as shares of the peak displacement."""
    fits, history = report.tables["spring_fit"], report.tables["spring_history"]
    genetic, gradient = (
        tables.where(fits, volume_force=False, method=name, used_in_fit=True) for name in ("genetic", "gradient")
    )
    return {
        "genetic": genetic,
        "ahead": 1.0 - gradient["fitness"].median() / np.median(genetic["fitness"]),
        "passed": {words: as_fit_after(history, "gradient", force) for force, words in FORCES.items()},
        "medians": _medians(fits),
        "good": (FITTED, OTHERS),
        "met": _met(fits[~fits["method"].isin(["gradient_all"])]),
    }


def _met(fits: pd.DataFrame) -> list[str]:
    """Name the methods whose median errors are small enough, with and without the volume force."""
    medians = fits.groupby(["volume_force", "method", "press", "used_in_fit"], sort=False)["rmse_of_peak"].median()
    bounds = [FITTED if in_fit else OTHERS for in_fit in medians.index.get_level_values("used_in_fit")]
    met = (medians <= bounds).groupby(level=["volume_force", "method"], sort=False).all()
    return [f"{look(method).label} ({FORCES[force]})" for force, method in met.index[met]]


def _medians(fits: pd.DataFrame) -> pd.DataFrame:
    """Tabulate times, fitness and errors of each method, without and with volume force: medians and ranges of seeds."""
    share_of_fits = fits.groupby("press", sort=False)["used_in_fit"].mean()
    fitted_presses, rows = set(share_of_fits.index[share_of_fits == share_of_fits.max()]), []
    for (force, method), runs in fits.groupby(["volume_force", "method"], sort=False):
        row = {"forces": FORCES[force], "method": look(method).label}
        row |= {"time": seconds(runs[runs["used_in_fit"]].groupby("seed")["seconds"].first().median())}
        row |= {"fitness [m]": runs[runs["press"] == fits["press"].iloc[0]]["fitness"].median()}
        for press, of_press in runs.groupby("press", sort=False):
            row[f"{press} press{' (fitted)' if press in fitted_presses else ''}"] = _spread(of_press["rmse_of_peak"])
        rows.append(row)
    return pd.DataFrame(rows)


def _spread(values: pd.Series) -> str:
    """Return the median, and the range if there are several values."""
    median, least, largest = map(percent, (values.median(), values.min(), values.max()))
    return median if len(values) == 1 else f"{median} [{least}, {largest}]"
