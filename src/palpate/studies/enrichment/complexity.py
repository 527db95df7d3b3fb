"""Measure the paper's table 3: how the cost of each operation grows with feature length and samples.

Building A is measured whole and without the inversion of Φ: the paper's O(r k²) leaves the k³ of the
inversion out, so its order can only hold for the assembly of Φ. Sizes are large enough for the cost of
calling numpy to vanish, except where the whole of building A is measured: there feature lengths are those of
the paper, because that is where the inversion it leaves out counts.
"""

import time
import timeit
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from palpate.models.enrichment.features import nearest_first
from palpate.models.enrichment.paper_enrichment import gaussian, inverse, query_weights, squared_distances


class Operation(NamedTuple):
    """prepare(r, k, random) gives the call to be timed; ``grows`` is the paper's order as a function.

    lengths : the r tried
    """

    prepare: Callable[[int, int, np.random.Generator], Callable[[], object]]
    lengths: tuple[int, ...]
    paper_order: str
    grows: Callable[[np.ndarray, np.ndarray], np.ndarray]


def _sorting(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    points, contacts = random.normal(size=(r // 3, 3)), random.normal(size=(k, 3))
    return lambda: [nearest_first(points, contact, 1.0) for contact in contacts]


def _assembling(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    known = random.normal(size=(k, r))
    return lambda: gaussian(squared_distances(known, known), np.sqrt(r))


def _building(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    known = random.normal(size=(k, r))
    return lambda: inverse(gaussian(squared_distances(known, known), np.sqrt(r)))


def _weighing(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    known, asked = random.normal(size=(k, r)), random.normal(size=(1, r))
    return lambda: query_weights(squared_distances(known, asked), np.sqrt(r))


OPERATIONS = {
    "sorting": Operation(_sorting, (3000, 6000, 12000, 24000, 48000), "O(k r log r)", lambda r, k: k * r * np.log(r)),
    "building_phi": Operation(_assembling, (300, 600, 1200, 2400, 4800), "O(r k^2)", lambda r, k: r * k**2),
    "building_a": Operation(_building, (30, 60, 120, 240, 480), "O(r k^2)", lambda r, k: r * k**2),
    "building_w": Operation(_weighing, (1000, 2000, 4000, 8000, 16000), "O(r k)", lambda r, k: r * k),
}


def measure(samples: Sequence[int], seed: int) -> pd.DataFrame:
    """Measure the seconds of each operation on random data over its lengths × ``samples``: operation, r, k, seconds.

    Processor time of the one thread, the fastest of three turns: a long call is interrupted by what else the
    machine does more often than a short one, and on the clock that looks like a higher order.
    """
    from threadpoolctl import threadpool_limits

    random = np.random.default_rng(seed)
    rows = []
    with threadpool_limits(limits=1):
        for name, operation in OPERATIONS.items():
            sizes = [(r, k) for r in operation.lengths for k in samples]
            calls = [operation.prepare(r, k, random) for r, k in sizes]
            seconds = np.min([[_seconds(call) for call in calls] for _ in range(3)], axis=0)
            rows += [(name, r, k, taken) for (r, k), taken in zip(sizes, seconds, strict=True)]
    return pd.DataFrame(rows, columns=["operation", "r", "k", "seconds"])


def _seconds(call: Callable[[], object]) -> float:
    """Take the mean over as many calls as take about 2 ms."""
    timer = timeit.Timer(call, timer=time.thread_time)
    number = max(1, int(2e-3 / timer.timeit(number=1)))
    return timer.timeit(number=number) / number


def complexity_rows(measured: pd.DataFrame) -> pd.DataFrame:
    """Tabulate complexity.csv: fitted exponents with 95 % confidence intervals, beside the paper's order.

    ``paper_exponent_r`` and ``_k`` are the paper's formula fitted over the same sizes, which turns r log r
    into a number.
    """
    rows = []
    for name, operation in OPERATIONS.items():
        table = measured[measured["operation"] == name]
        r, k = table["r"].to_numpy(float), table["k"].to_numpy(float)
        row: dict[str, Any] = {"operation": name, "paper_order": operation.paper_order}
        row |= {"r_min": int(r.min()), "r_max": int(r.max()), "k_min": int(k.min()), "k_max": int(k.max())}
        expected, _ = fit_exponents(r, k, operation.grows(r, k))
        found, half = fit_exponents(r, k, table["seconds"].to_numpy())
        for i, size in enumerate("rk"):
            row |= {
                f"exponent_{size}": found[i],
                f"exponent_{size}_low": found[i] - half[i],
                f"exponent_{size}_high": found[i] + half[i],
                f"paper_exponent_{size}": expected[i],
            }
        rows.append(row)
    return pd.DataFrame(rows)


def fit_exponents(r: np.ndarray, k: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit a and b of seconds ≈ c rᵃ kᵇ by least squares on logarithms, and half their 95 % intervals."""
    design = np.column_stack([np.log(r), np.log(k), np.ones(len(r))])
    logs = np.log(seconds)
    coefficients = np.linalg.lstsq(design, logs)[0]
    freedom = len(r) - 3
    variance = np.sum((logs - design @ coefficients) ** 2) / freedom
    spread = np.sqrt(variance * np.linalg.inv(design.T @ design).diagonal())
    return coefficients[:2], stats.t.ppf(0.975, freedom) * spread[:2]
