"""Which calls are timed, and what a row adds up."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.studies.enrichment import timing


@pytest.fixture
def asked() -> list:
    return []


@pytest.fixture
def db():
    return SimpleNamespace(
        coarse=lambda protocol: np.full((6, 2, 3), {"paper": 1.0, "live": 2.0}[protocol]),
        contact=np.arange(6),
        force=np.zeros((6, 3)),
    )


@pytest.fixture
def methods(asked):
    """The methods of the paper's table and linear FEM, which note what they are asked."""

    def method(name):
        return SimpleNamespace(predict=lambda coarse, contact, force: asked.append((name, coarse[0, 0], contact)))

    names = [*timing.PAPERS_TABLE.values(), "linear_fem"]
    return {protocol: {name: method(name) for name in names} for protocol in ("paper", "live")}


def test_samples_go_from_the_smallest_to_the_largest_peak():
    peaks = np.array([5.0, 1, 4, 2, 3, 9, 8, 7, 6])
    test = np.array([0, 2, 3, 4, 5, 6, 7, 8])
    chosen = timing.choose_samples(peaks, test)
    assert len(chosen) == 5
    assert peaks[chosen[0]] == 2 and peaks[chosen[-1]] == 9
    assert (np.diff(peaks[chosen]) > 0).all()


def test_all_in_is_a_coarse_simulation_and_then_ours(db, methods, asked):
    coarse = [lambda i=i: asked.append(("coarse", i)) for i in range(5)]
    fine = [lambda: None] * 5
    table = timing.timing_table(db, methods, fine, coarse, range(5), "bar", 1, {})
    assert list(table["method"]) == ["fine_fem", "unordered", "contact_ordered", "detail_correction", "live_all_in"]
    pairs = [(a, b) for a, b in pairwise(asked) if a[0] == "coarse"]
    assert pairs and all(b == ("detail_correction", 2.0, a[1]) for a, b in pairs)


def test_live_costs_include_the_coarse_simulation_except_for_linear_fem(db, methods, monkeypatch):
    monkeypatch.setattr(timing, "measure", lambda call, repeats: SimpleNamespace(median_s=1.0, p95_s=2.0))
    table = timing.cost_table(db, methods, [lambda: None], range(5), "bar", 1).set_index(["protocol", "method"])
    assert table.loc[("paper", "detail_correction"), "online_median_s"] == 1.0
    assert table.loc[("live", "detail_correction"), "online_median_s"] == 2.0
    assert table.loc[("live", "detail_correction"), "online_p95_s"] == 3.0
    assert table.loc[("live", "linear_fem"), "online_median_s"] == 1.0
