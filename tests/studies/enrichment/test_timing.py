"""Known exponents are found again, with an interval that means what it says."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.studies.enrichment import timing
from palpate.studies.enrichment.timing import fit_exponents

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


@pytest.fixture
def asked() -> list:
    return []


@pytest.fixture
def given(asked):
    """A database, and the methods of the paper's table and linear FEM, which note what they are asked."""
    coarse = {"paper": np.full((6, 2, 3), 1.0), "live": np.full((6, 2, 3), 2.0)}
    db = SimpleNamespace(coarse=coarse.get, contact=np.arange(6), force=np.zeros((6, 3)))

    def method(name):
        return SimpleNamespace(predict=lambda coarse, contact, force: asked.append((name, coarse[0, 0], contact)))

    names = [*timing.PAPERS_TABLE.values(), "linear_fem"]
    return db, {protocol: {name: method(name) for name in names} for protocol in ("paper", "live")}


def test_all_in_is_a_coarse_simulation_and_then_ours(given, asked):
    coarse = [lambda i=i: asked.append(("coarse", i)) for i in range(5)]
    fine = [lambda: None] * 5
    table = timing.timing_table(*given, fine, coarse, range(5), "bar", 1, {})
    assert list(table["method"]) == ["fine_fem", "unordered", "contact_ordered", "detail_correction", "live_all_in"]
    pairs = [(a, b) for a, b in pairwise(asked) if a[0] == "coarse"]
    assert pairs and all(b == ("detail_correction", 2.0, a[1]) for a, b in pairs)


def test_live_costs_include_the_coarse_simulation_except_for_linear_fem(given, monkeypatch):
    monkeypatch.setattr(timing, "median_and_p95", lambda call, repeats: (1.0, 2.0))
    table = timing.cost_table(*given, [lambda: None], range(5), "bar", 1).set_index(["protocol", "method"])
    found = table[["online_median_s", "online_p95_s"]]
    assert found.loc[("paper", "detail_correction")].tolist() == [1.0, 2.0]
    assert found.loc[("live", "detail_correction")].tolist() == [2.0, 3.0]
    assert found.loc[("live", "linear_fem")].tolist() == [1.0, 2.0]
