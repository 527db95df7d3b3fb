"""A kind of question is one class: all else that is measured of it follows."""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from fixtures.stub import Stub

from palpate.benchmark.load import Refused
from palpate.benchmark.measuring import (
    REASON,
    REFUSED,
    WARM_UP,
    Kind,
    measure,
    prepared,
    prepared_settings,
    said,
    tables,
    time_calls,
)
from palpate.errors import NotConverged
from palpate.models.own_model import as_model
from palpate.table_declaration import Table

STRETCHES = Table(
    "stretches",
    "The errors of models of a bar.",
    """
    scene model setting law: what answers
    samples failures force_error force_error_median force_error_p95: errors of the force
    online_median_s online_p95_s online_max_s offline_s failure: times [s]
    """,
)


class Stretches(Kind):
    """A bar is stretched, and its force is strain + strain²."""

    question = ("strain",)
    errors = spread = ("force_error",)
    more = ("preparation_s",)
    table = STRETCHES

    def ready(self, solver, i):
        if self.named[i]["strain"] < 0.0:
            raise Refused("a bar is not pressed")

    def call(self, solver, i):
        return partial(solver.respond, self.named[i]["strain"])

    def judged(self, i, answer):
        strain = self.named[i]["strain"]
        return {"force_error": answer / (strain + strain**2) - 1.0}


def test_a_made_up_kind_of_question_is_prepared_asked_timed_judged_and_tabulated():
    strains, asked = [0.1, -0.1, 0.3, 0.9], []

    def linear(strain):
        asked.append(strain)
        if strain > 0.5:
            raise NotConverged("it tears", [])
        return strain

    def lost():
        raise NotConverged("no bar", [])

    kind, made = Stretches({"scene": "bar"}, [{"strain": each} for each in strains]), Stub(respond=linear)
    models = {"linear": lambda: made, "lost": lost}
    settings = [prepared({"model": name, "setting": ""}, make, {"training": 40.0}) for name, make in models.items()]
    questions, rows = measure(kind, settings, 8, 9.0)
    assert asked == [0.1, 0.3, 0.1, 0.3, 0.9, 0.1, 0.3, 0.1, 0.3]  # two to warm up; what has failed is asked no more
    assert [row["failure"] for row in questions[:4]] == ["", "a bar is not pressed", "", "it tears"]
    assert questions[1][REASON] == REFUSED
    of_questions, of_settings = tables(kind, questions, rows)
    assert list(of_questions["strain"]) == 2 * strains and of_questions["preparation_s"].notna().sum() == 4
    one, other = of_settings.to_dict("records")
    wrong = [1.0 / 1.1 - 1.0, 1.0 / 1.3 - 1.0]
    assert one["force_error"] == pytest.approx(np.mean(wrong)) and (one["samples"], one["failures"]) == (4, 2)
    assert one["force_error_p95"] == pytest.approx(np.percentile(np.abs(wrong), 95))
    assert 0.0 < one["online_median_s"] <= one["online_p95_s"] and 40.0 < one["offline_s"] < 41.0
    assert (other["failures"], other["failure"]) == (4, "no bar") and np.isnan(other["force_error"])


@dataclass(frozen=True)
class Bar:
    """A model of the user's that answers such a question by a method of its name."""

    exponent: int = 1
    law = "linear"

    def prepare(self, case):
        return self

    def stretch(self, strain):
        return strain + strain**2 if self.exponent == 2 else strain


def test_a_class_of_ones_own_answers_a_made_up_kind_of_question(slab_case):
    kind = Stretches({"scene": "bar"}, [{"strain": 0.1}])
    models = [as_model(Bar(exponent), "bar.py", "stretch") for exponent in (1, 2)]
    of_questions, of_settings = tables(kind, *measure(kind, prepared_settings(slab_case[0], "bar", models), 1, 0.0))
    assert list(of_questions["setting"]) == list(of_settings["setting"]) == ["exponent=1", "exponent=2"]
    assert of_settings["force_error"].tolist() == pytest.approx([1.0 / 1.1 - 1.0, 0.0])
    assert list(of_settings["law"]) == 2 * ["linear"]


def test_warm_up_is_dropped():
    seen = []
    timed = time_calls([lambda: seen.append(1)], 100)
    assert len(timed.seconds[0]) == 100 and len(seen) == 100 + WARM_UP


def test_slow_calls_are_repeated_five_times_and_what_is_received_is_off_the_clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])

    def take(seconds):
        now[0] += seconds

    assert time_calls([lambda: take(2.0)], 100).seconds == [[2.0] * 5]
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


def test_one_thread_inside():
    from threadpoolctl import threadpool_info, threadpool_limits

    threads = []
    np.eye(3) @ np.eye(3)
    with threadpool_limits(2):
        assert 2 in {pool["num_threads"] for pool in threadpool_info()}
        time_calls([lambda: threads.extend(pool["num_threads"] for pool in threadpool_info())], 1)
    assert set(threads) == {1}
