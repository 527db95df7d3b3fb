"""Time and memory of each component over its size, far beyond sizes that run in real time, and fitted exponents."""

import gc
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.studies.scaling import components
from palpate.table import Table

FITTED_SIZES = 4
"""Number of largest sizes over which an exponent is fitted: at smaller ones the cost of the call itself matters."""
LEAST_MB = 10.0
"""Least memory [MB] that is considered: less is hidden in the memory that the process already had."""


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the slopes of log seconds and log memory over log size.

    The columns are component, stage, seconds_exponent and memory_exponent; NaN where there are fewer than two sizes.
    """
    rows = []
    for (component, stage), group in table.groupby(["component", "stage"], sort=False):
        largest = group.sort_values("size").tail(FITTED_SIZES)
        held = largest[largest["memory_mb"] >= LEAST_MB]
        rows.append((component, stage, _slope(largest, "seconds"), _slope(held, "memory_mb")))
    return pd.DataFrame(rows, columns=["component", "stage", "seconds_exponent", "memory_exponent"])


def _slope(group: pd.DataFrame, column: str) -> float:
    if group["size"].nunique() < 2:
        return np.nan
    return float(np.polyfit(np.log(group["size"]), np.log(group[column]), 1)[0])


LONG_S = 0.2
"""A longer call is timed once; a shorter one is repeated for this time, and the median counts."""

COMPONENTS = {
    "fem": components.fem,
    "fine_nodes": components.fine_nodes,
    "samples": components.samples,
    "triangles": components.triangles,
    "particles": components.particles,
    "cores": components.cores,
}
"""The components by their key in the config: each runs at a size with a Meter and returns the size and its unit."""


class Meter:
    """Time and memory of the stages of one component at one size, the memory relative to the meter's creation.

    clock : processor time of this thread, which excludes other processes; ``time.perf_counter`` where several threads
        work
    patience_s : how long short calls are repeated; None for LONG_S
    """

    def __init__(self, clock: Callable[[], float] = time.thread_time, patience_s: float | None = None):
        gc.collect()
        self.clock, self._patience_s = clock, LONG_S if patience_s is None else patience_s
        self.stages: list[dict[str, Any]] = []
        self._before = _resident_mb("VmRSS")

    def once(self, stage: str, call: Callable, *given: Any) -> Any:
        """Time one call and return its result."""
        return self._timed(stage, call, given, 0.0)

    def often(self, stage: str, call: Callable, *given: Any) -> Any:
        """Time calls until they have taken ``patience_s``, at least one, and return the result of the last."""
        return self._timed(stage, call, given, self._patience_s)

    def _timed(self, stage: str, call: Callable, given: tuple, patience: float) -> Any:
        _forget_peak()
        seconds: list[float] = []
        while not seconds or sum(seconds) < patience:
            start = self.clock()
            result = call(*given)
            seconds.append(self.clock() - start)
        grown = max(0.0, _resident_mb("VmHWM") - self._before)
        self.stages.append({"stage": stage, "seconds": float(np.median(seconds)), "memory_mb": grown})
        return result


SCALING = Table(
    "scaling",
    "The time and the memory of each component over the size of its problem, with fitted exponents.",
    """
    component unit size: what grows, and its size in this unit
    stage seconds: a part of the work, and the time of one call [s]
    memory_mb: largest growth of the process' resident memory [1e6 bytes]
    threads: that worked
    seconds_exponent memory_exponent: fitted powers of the size, over the largest sizes
    """,
)


def measure(component: str, sizes: list[int], report: Callable[[int], None] = lambda size: None) -> pd.DataFrame:
    """Measure the rows of scaling.csv of one of COMPONENTS: one row for each size and stage.

    The memory of small sizes is hidden in what the process already had. ``report`` is called with each size.
    """
    run = COMPONENTS[component]
    clock = time.perf_counter if component == "cores" else time.thread_time
    run(sizes[0], Meter(clock, 0.0))  # compiles what is called
    rows = []
    for asked in sizes:
        meter = Meter(clock)
        unit, size = run(asked, meter)
        threads = size if component == "cores" else 1
        labels = {"component": component, "unit": unit, "size": size}
        rows += [labels | stage | {"threads": threads} for stage in meter.stages]
        report(size)
    table = pd.DataFrame(rows)
    return table.merge(exponents(table), on=["component", "stage"])


def doubling(most: int) -> list[int]:
    """Return 1, 2, 4 … up to and including ``most``."""
    return [2**k for k in range(most.bit_length()) if 2**k < most] + [most]


def _forget_peak() -> None:
    """Reset the operating system's record of the peak of resident memory, where that is possible."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _resident_mb(what: str) -> float:
    """Return this process' resident memory [1e6 bytes], now (VmRSS) or at its peak (VmHWM); 0 where it is unknown."""
    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return sum(1.024e-3 * float(line.split()[1]) for line in lines if line.startswith(f"{what}:"))
