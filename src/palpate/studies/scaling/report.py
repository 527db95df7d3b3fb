"""Report how time and memory grow with the size of the problem."""

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.material import Report, Section
from palpate.report.number_format import seconds
from palpate.studies.scaling.measure_scaling import LARGEST, exponents
from palpate.studies.scaling.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Scaling"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    scaling = report.tables["scaling"]
    fem = tables.where(scaling, component="fem")
    largest = fem[fem["size"] == fem["size"].max()]
    press = tables.where(largest, stage="respond").iloc[0]
    memory = f"{1e-3 * largest['memory_mb'].max():.2g} GB"
    return {
        "headline": (
            f"A press of {press['size']:,} tetrahedra takes {seconds(press['seconds'])} and {memory} on one core; "
            f"the time grows with the number of elements{_power(press['seconds_exponent'])}."
        ),
        "scaling_elements": f"{press['size']:,}",
        "scaling_seconds": seconds(press["seconds"]),
        "scaling_memory": memory,
        "scaling_whole": _power(_whole(fem)).strip() or "by a power that needs more than two sizes to be fitted",
        "scaling_largest": str(LARGEST),
        "scaling_cores": _speedup(tables.where(scaling, component="cores")),
    }


def _power(exponent: float) -> str:
    """Return "to the power of …", or nothing where it is not known."""
    return f" to the power of {exponent:.2f}" if np.isfinite(exponent) else ""


def _whole(fem: pd.DataFrame) -> float:
    """Return the exponent of the time of a first press: the patterns of its matrices, and the solution."""
    parts = fem[fem["stage"].isin(["set up", "respond"])]
    whole = parts.groupby("size", as_index=False)[["seconds", "memory_mb"]].sum()
    return float(exponents(whole.assign(component="fem", stage="whole"))["seconds_exponent"].iloc[0])


def _speedup(cores: pd.DataFrame) -> str:
    """Compare a generation on all cores with one on a single core."""
    by_size = cores.groupby("size")["seconds"].min()
    if len(by_size) < 2:
        return "there is one core only"
    most = by_size.index.max()
    return f"{most} cores are {by_size.loc[by_size.index.min()] / by_size.loc[most]:.2g} times as fast as one"


def sections(report: Report) -> list[Section]:
    """Return the figure and its table."""
    return [("scaling_section", "Up to millions of elements", report.figure("scaling") + report.folded("scaling"))]
