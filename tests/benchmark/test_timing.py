"""What is counted and what is dropped; how long it takes is the machine's affair."""

import time

import numpy as np
import pytest

from palpate.benchmark.timing import WARM_UP, measure, said, time_calls
from palpate.errors import NotConverged


def test_warm_up_is_dropped():
    seen = []
    timing = measure([lambda: seen.append(1)], 100)
    assert timing.calls == 100 and len(seen) == 100 + WARM_UP
    assert 0 <= timing.median_s <= timing.p95_s


def test_slow_calls_are_repeated_five_times_and_what_is_received_is_off_the_clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])

    def take(seconds):
        now[0] += seconds

    assert measure([lambda: take(2.0)], 100) == pytest.approx((2.0, 2.0, 5))
    timed = time_calls([lambda: take(0.25)], 4, np.inf, lambda i, answer: take(10.0))
    assert timed.seconds == [[0.25] * 4]


def test_calls_are_made_in_turn_each_once_at_least():
    made = []
    calls = [lambda i=i: made.append(i) for i in range(4)]
    timed = time_calls(calls, 6, np.inf)
    assert made[WARM_UP:] == [0, 1, 2, 3, 0, 1] and [len(each) for each in timed.seconds] == [2, 2, 1, 1]
    assert [len(each) for each in time_calls(calls, 100, 0.0).seconds] == [1, 1, 1, 1]


def test_a_call_that_fails_is_made_no_more_and_answers_may_be_refused():
    def fail():
        raise NotConverged("no\nanswer", [])

    def refuse(i, answer):
        if answer == 3:
            raise NotConverged("three", [])

    timed = time_calls([lambda: 1, fail, lambda: 3], 9, np.inf, refuse)
    assert [said(each) for each in timed.failures if each] == ["no answer", "three"] and not timed.failures[0]
    assert [len(each) for each in timed.seconds] == [3, 0, 0]
    with pytest.raises(NotConverged, match="no\nanswer"):
        measure([fail], 3)


def test_one_thread_inside():
    from threadpoolctl import threadpool_info, threadpool_limits

    threads = []
    np.eye(3) @ np.eye(3)
    with threadpool_limits(2):
        assert 2 in {pool["num_threads"] for pool in threadpool_info()}
        measure([lambda: threads.extend(pool["num_threads"] for pool in threadpool_info())], 1)
    assert set(threads) == {1}
