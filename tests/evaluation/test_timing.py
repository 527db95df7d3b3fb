"""What is counted and what is dropped; how long it takes is the machine's affair."""

import time

import numpy as np
import pytest

from palpate.evaluation.timing import machine, measure, timing_rows


def test_warm_up_is_dropped():
    seen = []
    timing = measure(lambda: seen.append(1), 100)
    assert timing.calls == 100 and len(seen) == 103
    assert 0 <= timing.median_s <= timing.p95_s


def test_slow_calls_are_repeated_five_times(monkeypatch):
    clock = iter(np.cumsum(np.tile([0.5, 2.0], 6)).tolist())
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    assert measure(lambda: None, 100) == pytest.approx((2.0, 2.0, 5))


def test_one_thread_inside():
    from threadpoolctl import threadpool_info, threadpool_limits

    threads = []
    np.eye(3) @ np.eye(3)
    with threadpool_limits(2):
        assert 2 in {pool["num_threads"] for pool in threadpool_info()}
        measure(lambda: threads.extend(pool["num_threads"] for pool in threadpool_info()), 1)
    assert set(threads) == {1}


def test_rows():
    calls = {"unordered": [lambda: None] * 5, "detail_correction": [lambda: None] * 5}
    table = timing_rows("liver", calls, 2, {"unordered": 0.603})
    assert table.columns.tolist() == [
        "body",
        "method",
        "d1_s",
        "d2_s",
        "d3_s",
        "d4_s",
        "d5_s",
        "mean_s",
        "paper_mean_s",
    ]
    deformations = table[[f"d{i}_s" for i in range(1, 6)]]
    assert table["mean_s"].to_numpy() == pytest.approx(deformations.mean(axis=1).to_numpy())
    assert table["paper_mean_s"].iloc[0] == 0.603 and np.isnan(table["paper_mean_s"].iloc[1])


def test_the_machine_is_one_line():
    assert "cores" in machine() and "\n" not in machine()
