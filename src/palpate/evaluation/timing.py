"""How long an online call takes, measured the same way for everything."""

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

WARM_UP = 3
SLOW_S = 1.0
SLOW_CALLS = 5


class Timing(NamedTuple):
    """Seconds a call took over ``calls`` calls."""

    median_s: float
    p95_s: float
    calls: int


def measure(call: Callable[[], object], repeats: int) -> Timing:
    """Time ``call`` on one BLAS thread: warm-up dropped, ``repeats`` calls, or 5 if one takes over 1 s.

    Median and 95th percentile, not mean and minimum: a surgeon's hand feels the frames that come late.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        first = _once(call)
        if first <= SLOW_S:
            for _ in range(WARM_UP - 1):
                call()
        times = [_once(call) for _ in range(SLOW_CALLS if first > SLOW_S else repeats)]
    return Timing(float(np.median(times)), float(np.percentile(times, 95)), len(times))


def _once(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def timing_rows(
    body: str, calls: Mapping[str, Sequence[Callable[[], object]]], repeats: int, means: Mapping[str, float]
) -> pd.DataFrame:
    """Rows of enrichment_timing.csv: median seconds of each deformation's call, and the paper's mean.

    calls : by method, one call a deformation, d1, d2, …; means : the paper's, by method [s]
    """
    rows = []
    for method, deformations in calls.items():
        seconds = [measure(call, repeats).median_s for call in deformations]
        row = {"body": body, "method": method}
        row |= {f"d{i}_s": value for i, value in enumerate(seconds, start=1)}
        row |= {"mean_s": float(np.mean(seconds)), "paper_mean_s": means.get(method, np.nan)}
        rows.append(row)
    return pd.DataFrame(rows)


def machine() -> str:
    """One line on what was measured on: processor, cores, system, Python and numpy."""
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        names = [line.split(":", 1)[1].strip() for line in information.read_text().splitlines() if "model name" in line]
        processor = names[0] if names else processor
    return (
        f"{processor}, {os.cpu_count()} cores, {platform.system()} {platform.release()}, "
        f"Python {platform.python_version()}, numpy {np.__version__}, one BLAS thread"
    )
