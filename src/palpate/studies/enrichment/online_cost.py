"""Time what a query costs at run time, and tabulate it in two tables."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Method
from palpate.benchmark.database import Database
from palpate.benchmark.presses import nodal_forces
from palpate.benchmark.timing import Call, measure, timing_rows
from palpate.bodies.body import Body
from palpate.solvers.equilibrium import Equilibrium

PAPERS_TABLE = {
    "unordered": "unordered_nonnegative_a",
    "contact_ordered": "ordered_nonnegative_a",
    "detail_correction": "detail_correction",
}
"""Rows of the paper's tables 4 and 5 and the methods that stand there."""
DEFORMATIONS = 5
"""The paper times five of them, d1 to d5."""
FEM_REPEATS = 5
"""A fine simulation takes long and is no online method."""


def solves(body: Body, level: int, loads: pd.DataFrame, tolerance: float) -> list[Call]:
    """Make one call for each row of ``loads``, which simulates it from rest on one level."""
    solver = Equilibrium(body, level)
    nodal = [nodal_forces(body, level, load) for _, load in loads.iterrows()]
    return [partial(solver.solve, forces, tolerance) for forces in nodal]


def queries(db: Database, method: Method, protocol: str, samples: Sequence[int]) -> list[Call]:
    """Make one call for each sample, which predicts its fine response from the coarse one of ``protocol``."""
    coarse = db.coarse(protocol)
    return [partial(method.predict, coarse[i], int(db.contact[i]), db.force[i]) for i in samples]


def timing_table(
    db: Database,
    methods: Mapping[str, Mapping[str, Method]],
    fine: list[Call],
    coarse: list[Call],
    samples: Sequence[int],
    body: str,
    repeats: int,
    means: Mapping[str, float],
) -> pd.DataFrame:
    """Tabulate enrichment_timing.csv: fine FEM, the paper's two features, and detail
    correction without and with its coarse simulation.

    methods : by protocol and name; fine, coarse : one simulation a sample
    means : the paper's mean seconds, by row
    """
    online = {name: queries(db, methods["paper"][method], "paper", samples) for name, method in PAPERS_TABLE.items()}
    corrected = queries(db, methods["live"]["detail_correction"], "live", samples)
    online["live_all_in"] = [partial(_in_turn, *pair) for pair in zip(coarse, corrected, strict=True)]
    return pd.concat(
        [timing_rows(body, {"fine_fem": fine}, FEM_REPEATS, means), timing_rows(body, online, repeats, means)]
    )


def cost_table(
    db: Database,
    methods: Mapping[str, Mapping[str, Method]],
    coarse: list[Call],
    samples: Sequence[int],
    body: str,
    repeats: int,
) -> pd.DataFrame:
    """Tabulate online_cost.csv: body, method, protocol, online_median_s, online_p95_s over all ``samples``.

    In the live protocol the coarse simulation is part of a query, at its median; linear FEM needs none.
    """
    simulated = measure(coarse, repeats).median_s
    rows = []
    for protocol, fitted in methods.items():
        for name, method in fitted.items():
            query = measure(queries(db, method, protocol, samples), repeats)
            before = simulated if protocol == "live" and name != "linear_fem" else 0.0
            rows.append([body, name, protocol, before + query.median_s, before + query.p95_s])
    return pd.DataFrame(rows, columns=["body", "method", "protocol", "online_median_s", "online_p95_s"])


def choose_samples(peaks: np.ndarray, test: np.ndarray) -> np.ndarray:
    """Choose five of the samples ``test`` from the smallest to the largest of their peaks (k,) [m], evenly."""
    ranked = test[np.argsort(peaks[test], kind="stable")]
    return ranked[np.linspace(0, len(ranked) - 1, DEFORMATIONS).round().astype(int)]


def _in_turn(first: Call, second: Call) -> None:
    first()
    second()
