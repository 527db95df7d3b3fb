"""Report how time and memory grow with the size of the problem."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.material import Report
from palpate.studies.scaling.measure_scaling import FITTED_SIZES, exponents

TITLE = "Scaling"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    scaling = report.tables["scaling"]
    fem = tables.where(scaling, component="fem")
    largest = fem[fem["size"] == fem["size"].max()]
    press = tables.where(largest, stage="respond").iloc[0]
    cores = tables.where(scaling, component="cores").groupby("size")["seconds"].min()
    return {
        "elements": int(press["size"]),
        "press_s": press["seconds"],
        "memory_gb": 1e-3 * largest["memory_mb"].max(),
        "power": press["seconds_exponent"],
        "power_of_first": _power_of_first(fem),
        "fitted_over": FITTED_SIZES,
        "cores": int(cores.index.max()),
        "speedup": cores.loc[cores.index.min()] / cores.loc[cores.index.max()],
    }


def _power_of_first(fem: pd.DataFrame) -> float:
    """Return the exponent of the time of a first press, which finds the patterns of its matrices; NaN if unknown."""
    parts = fem[fem["stage"].isin(["set up", "respond"])]
    whole = parts.groupby("size", as_index=False)[["seconds", "memory_mb"]].sum()
    return float(exponents(whole.assign(component="fem", stage="whole"))["seconds_exponent"].iloc[0])
