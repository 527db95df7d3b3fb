"""Known exponents are found again, with an interval that means what it says."""

import numpy as np
import pandas as pd
import pytest

from palpate.studies.enrichment.timing import OPERATIONS, complexity_rows, fit_exponents

R, K = (grid.ravel() for grid in np.meshgrid([300.0, 600, 1200, 2400, 4800], [25.0, 50, 100, 200]))


@pytest.mark.parametrize(("a", "b"), [(1, 2), (1, 1), (0.3, 2.7)])
def test_exact_exponents(a, b):
    found, half = fit_exponents(R, K, 3e-9 * R**a * K**b)
    assert found == pytest.approx([a, b], abs=1e-10)
    assert half == pytest.approx([0, 0], abs=1e-10)


def test_intervals_cover_the_truth_19_times_in_20():
    random = np.random.default_rng(0)
    inside = np.zeros(2)
    for _ in range(1000):
        found, half = fit_exponents(R, K, 1e-9 * R * K**2 * np.exp(0.1 * random.normal(size=len(R))))
        inside += np.abs(found - [1, 2]) <= half
    assert inside / 1000 == pytest.approx([0.95, 0.95], abs=0.02)


def test_rows_put_the_papers_order_beside_the_measured_one():
    rows = [
        (name, r, k, 1e-9 * r * k * np.log(r))
        for name, operation in OPERATIONS.items()
        for r in operation.lengths
        for k in (25, 50, 100, 200)
    ]
    table = complexity_rows(pd.DataFrame(rows, columns=["operation", "r", "k", "seconds"])).set_index("operation")
    sorting = table.loc["sorting"]
    assert sorting["exponent_r"] == pytest.approx(sorting["paper_exponent_r"]) and sorting["exponent_r"] > 1
    assert table.loc["building_w", ["paper_exponent_r", "paper_exponent_k"]].tolist() == pytest.approx([1, 1])
    assert table.loc["building_a", ["paper_exponent_r", "paper_exponent_k"]].tolist() == pytest.approx([1, 2])
    assert (table["exponent_k_low"] <= table["exponent_k"]).all()


@pytest.mark.parametrize("name", list(OPERATIONS))
def test_every_operation_runs(name):
    OPERATIONS[name].prepare(30, 5, np.random.default_rng(0))()
