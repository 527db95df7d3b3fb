"""Report how time and memory grow with the size of the problem."""

from typing import Any

from palpate.report import tables
from palpate.report.report import Report
from palpate.studies.scaling.measure_scaling import FITTED_SIZES, exponents

TITLE = "Scaling"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    scaling = report.tables["scaling"]
    fem = tables.where(scaling, component="fem")
    largest = fem[fem["size"] == fem["size"].max()]
    press = tables.where(largest, stage="respond").iloc[0]
    cores = tables.where(scaling, component="cores").groupby("size")["seconds"].min()
    # a first press finds the patterns of its matrices, too
    first = fem[fem["stage"].isin(["set up", "respond"])]
    first = first.groupby("size", as_index=False)[["seconds", "memory_mb"]].sum().assign(component="fem", stage="whole")
    return {
        "elements": int(press["size"]),
        "press_s": press["seconds"],
        "memory_gb": 1e-3 * largest["memory_mb"].max(),
        "power": press["seconds_exponent"],
        "power_of_first": float(exponents(first)["seconds_exponent"].iloc[0]),
        "fitted_over": FITTED_SIZES,
        "cores": int(cores.index.max()),
        "speedup": cores.loc[cores.index.min()] / cores.loc[cores.index.max()],
    }
