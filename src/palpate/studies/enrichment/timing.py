"""Time paper 1's operations over their sizes (table 3), and what a query costs at run time (tables 4 and 5).

Building A is measured whole and without the inversion of Φ: the paper's O(r k²) leaves the k³ of the inversion out, so
its order can only hold for the assembly of Φ. Sizes are large enough for the cost of calling numpy to vanish, except
where the whole of building A is measured: there feature lengths are those of the paper, as there the inversion counts.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from palpate.benchmark.accuracy import Method
from palpate.benchmark.database import Database, read
from palpate.benchmark.measuring import Call, online, processor_seconds, time_calls
from palpate.benchmark.presses import samples_in
from palpate.benchmark.settings import FitOptions, Regression
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.models.enrichment.features import nearest_first
from palpate.models.enrichment.methods import build
from palpate.models.enrichment.paper_enrichment import gaussian, inverse, query_weights, squared_distances
from palpate.models.enrichment.training_samples import gather
from palpate.solvers.compliance import Compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.stores import stored
from palpate.studies.enrichment.samples import read_samples, sides
from palpate.table_declaration import Table


class Operation(NamedTuple):
    """An operation of paper 1 whose time is measured over r features and k samples.

    prepare : from r, k and a random generator to the call that is timed; lengths : values of r that are tried
    paper_order : the paper's order of the time in words, and ``grows`` as a function of r and k
    """

    prepare: Callable[[int, int, np.random.Generator], Callable[[], object]]
    lengths: tuple[int, ...]
    paper_order: str
    grows: Callable[[np.ndarray, np.ndarray], np.ndarray]


def _sorting(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    points, contacts = random.normal(size=(r // 3, 3)), random.normal(size=(k, 3))
    return lambda: [nearest_first(points, contact, 1.0) for contact in contacts]


def _assembling(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    features = random.normal(size=(k, r))
    return lambda: gaussian(squared_distances(features, features), np.sqrt(r))


def _building(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    features = random.normal(size=(k, r))
    return lambda: inverse(gaussian(squared_distances(features, features), np.sqrt(r)))


def _weighing(r: int, k: int, random: np.random.Generator) -> Callable[[], object]:
    features, query = random.normal(size=(k, r)), random.normal(size=(1, r))
    return lambda: query_weights(squared_distances(features, query), np.sqrt(r))


OPERATIONS = {
    "sorting": Operation(_sorting, (3000, 6000, 12000, 24000, 48000), "O(k r log r)", lambda r, k: k * r * np.log(r)),
    "building_phi": Operation(_assembling, (300, 600, 1200, 2400, 4800), "O(r k^2)", lambda r, k: r * k**2),
    "building_a": Operation(_building, (30, 60, 120, 240, 480), "O(r k^2)", lambda r, k: r * k**2),
    "building_w": Operation(_weighing, (1000, 2000, 4000, 8000, 16000), "O(r k)", lambda r, k: r * k),
}

COMPLEXITY = Table(
    "complexity",
    "Measured exponents of each operation's time in the numbers of features r and samples k, with 95 % intervals.",
    """
    operation paper_order: an operation, and its order in paper 1
    r_min r_max k_min k_max: sizes that were tried
    exponent_r exponent_r_low exponent_r_high paper_exponent_r: power of r, interval, and that of the paper's order
    exponent_k exponent_k_low exponent_k_high paper_exponent_k: the same of k
    """,
)


def time_complexity(samples: list[int], seed: int) -> pd.DataFrame:
    """Measure how the time of each operation on random data grows, for the rule of this name.

    Each is timed for all its lengths r and numbers of ``samples`` k: processor time of one thread, the fastest of three
    turns. Trap: on the clock, long calls are interrupted more often than short ones, which looks like a higher order.
    """
    from threadpoolctl import threadpool_limits

    random = np.random.default_rng(seed)
    rows = []
    with threadpool_limits(limits=1):
        for name, operation in OPERATIONS.items():
            sizes = [(r, k) for r in operation.lengths for k in samples]
            calls = [operation.prepare(r, k, random) for r, k in sizes]
            seconds = np.min([[processor_seconds(call, 2e-3) for call in calls] for _ in range(3)], axis=0)
            rows += [(name, r, k, operation_s) for (r, k), operation_s in zip(sizes, seconds, strict=True)]
    return complexity_rows(pd.DataFrame(rows, columns=["operation", "r", "k", "seconds"]))


def complexity_rows(measured: pd.DataFrame) -> pd.DataFrame:
    """Tabulate complexity.csv from the times ``measured``, with the columns operation, r, k and seconds.

    Intervals are of 95 %. ``paper_exponent_r`` and ``_k`` are fitted to the paper's formula at the same sizes, so that
    r log r is a power.
    """
    rows = []
    for name, operation in OPERATIONS.items():
        timed = measured[measured["operation"] == name]
        r, k = timed["r"].to_numpy(float), timed["k"].to_numpy(float)
        row: dict[str, Any] = {"operation": name, "paper_order": operation.paper_order}
        row |= {"r_min": int(r.min()), "r_max": int(r.max()), "k_min": int(k.min()), "k_max": int(k.max())}
        papers_exponents, _ = fit_exponents(r, k, operation.grows(r, k))
        exponents, half_widths = fit_exponents(r, k, timed["seconds"].to_numpy())
        for i, size in enumerate("rk"):
            row |= {
                f"exponent_{size}": exponents[i],
                f"exponent_{size}_low": exponents[i] - half_widths[i],
                f"exponent_{size}_high": exponents[i] + half_widths[i],
                f"paper_exponent_{size}": papers_exponents[i],
            }
        rows.append(row)
    return pd.DataFrame(rows)


def fit_exponents(r: np.ndarray, k: np.ndarray, seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit seconds ≈ c rᵃ kᵇ by least squares on logarithms; return (a, b) and half the widths of 95 % intervals."""
    design = np.column_stack([np.log(r), np.log(k), np.ones(len(r))])
    logs = np.log(seconds)
    coefficients = np.linalg.lstsq(design, logs)[0]
    degrees_of_freedom = len(r) - 3
    variance = np.sum((logs - design @ coefficients) ** 2) / degrees_of_freedom
    standard_errors = np.sqrt(variance * np.linalg.inv(design.T @ design).diagonal())
    return coefficients[:2], stats.t.ppf(0.975, degrees_of_freedom) * standard_errors[:2]


PAPERS_TABLE = {
    "unordered": "unordered_nonnegative_a",
    "contact_ordered": "ordered_nonnegative_a",
    "detail_correction": "detail_correction",
}
"""Rows of the paper's tables 4 and 5 and the methods that stand there."""
DEFORMATIONS = 5  # the paper times five of them, d1 to d5
FEM_REPEATS = 5  # a fine simulation takes long and is no online method


def solves(body: Body, level: int, loads: pd.DataFrame, tolerance: float) -> list[Call]:
    """Return calls without arguments, one for each row of ``loads``, that simulate it from rest on a level."""
    solver = Equilibrium(body, level)
    return [partial(solver.solve, sample.nodal(body, level), tolerance) for sample in samples_in(loads)]


def queries(db: Database, method: Method, protocol: str, samples: Sequence[int] | np.ndarray) -> list[Call]:
    """Return calls without arguments, one a sample, that predict the fine displacement from the coarse one."""
    coarse = db.coarse(protocol)
    return [partial(method.predict, coarse[i], int(db.contact[i]), db.force[i]) for i in samples]


ENRICHMENT_TIMING = Table(
    "enrichment_timing",
    "The time of five answers of each method, and their mean, laid out like table 4 of paper 1.",
    """
    body method: a body, and a method
    d1_s d2_s d3_s d4_s d5_s mean_s paper_mean_s: times of five loads, their mean, and the paper's [s]
    """,
)


def timing_table(
    db: Database,
    methods: Mapping[str, Mapping[str, Method]],
    fine: list[Call],
    coarse: list[Call],
    samples: Sequence[int] | np.ndarray,
    body: str,
    repeats: int,
    means: Mapping[str, float],
) -> pd.DataFrame:
    """Tabulate the rows of enrichment_timing.csv of one body.

    They are fine FEM, the paper's two kinds of features, and detail correction without and with its coarse simulation.
    methods : by protocol and name; fine, coarse : calls that simulate a sample each; means : the paper's, by row [s]
    """
    calls = {"fine_fem": fine}
    calls |= {name: queries(db, methods["paper"][method], "paper", samples) for name, method in PAPERS_TABLE.items()}
    corrections = queries(db, methods["live"]["detail_correction"], "live", samples)
    calls["live_all_in"] = [partial(_in_turn, *pair) for pair in zip(coarse, corrections, strict=True)]
    rows = []
    for method, deformations in calls.items():
        repeats_of_call = FEM_REPEATS if method == "fine_fem" else repeats
        seconds = [median_and_p95([call], repeats_of_call)[0] for call in deformations]
        rows.append([body, method, *seconds, np.mean(seconds), means.get(method, np.nan)])
    return ENRICHMENT_TIMING.frame(rows)


ONLINE_COST = Table(
    "online_cost",
    "The time that each method needs for one answer once it is prepared: median and 95th percentile.",
    """
    body method protocol: a body, a method, and what its coarse nodes come from
    online_median_s online_p95_s: time of an answer [s]; live, with the coarse simulation
    """,
)


def median_and_p95(calls: Sequence[Call], repeats: int) -> tuple[float, float]:
    """Time ``repeats`` calls of ``calls`` in turn; return median and 95th percentile [s], NotConverged if one fails."""
    timed = time_calls(calls, repeats)
    if failed := next(filter(None, timed.failures), None):
        raise failed
    times = online(timed.seconds)
    return times["online_median_s"], times["online_p95_s"]


def cost_table(
    db: Database,
    methods: Mapping[str, Mapping[str, Method]],
    coarse: list[Call],
    samples: Sequence[int] | np.ndarray,
    body: str,
    repeats: int,
) -> pd.DataFrame:
    """Tabulate the rows of online_cost.csv of one body: the time of a query of each method over ``samples``.

    In the live protocol a query includes the median time of a coarse simulation, which linear FEM does not need.
    """
    simulation_s, _ = median_and_p95(coarse, repeats)
    rows = []
    for protocol, fitted in methods.items():
        for name, method in fitted.items():
            median_s, p95_s = median_and_p95(queries(db, method, protocol, samples), repeats)
            coarse_s = simulation_s if protocol == "live" and name != "linear_fem" else 0.0
            rows.append([body, name, protocol, coarse_s + median_s, coarse_s + p95_s])
    return ONLINE_COST.frame(rows)


def choose_samples(peaks: np.ndarray, test: np.ndarray) -> np.ndarray:
    """Choose DEFORMATIONS of the samples ``test``, evenly from the smallest to the largest of their peaks (k,) [m]."""
    ranked = test[np.argsort(peaks[test], kind="stable")]
    return ranked[np.linspace(0, len(ranked) - 1, DEFORMATIONS).round().astype(int)]


def _in_turn(before: Call, after: Call) -> None:
    before()
    after()


def time_methods(
    input: Any, wildcards: Any, regression: Regression, seed: int, tolerance: float, repeats: int, published_means: dict
) -> dict[str, pd.DataFrame]:
    """Time all methods on the samples of one body, for the rule of this name."""
    body, db, compliance = load(input.body), read(input.database), stored(Compliance, input.compliance)
    train, test = sides(read_samples(input.samples), "samples")
    options = FitOptions(**dict(regression), split="samples", seed=seed)
    training = db.take(train)
    methods = {protocol: build(gather(training, protocol, options, compliance)) for protocol in ("paper", "live")}
    samples, name = choose_samples(db.peaks, test), wildcards.body
    loads = pd.read_csv(input.loads).iloc[samples]
    fine, coarse = (solves(body, level, loads, tolerance) for level in (len(body.levels) - 1, 0))
    timing = timing_table(db, methods, fine, coarse, samples, name, repeats, published_means)
    return {"timing": timing, "cost": cost_table(db, methods, coarse, samples, name, repeats)}
