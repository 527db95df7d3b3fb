"""Time online calls of all models by the same rules."""

import time
import timeit
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import NotConverged

WARM_UP = 2
"""Calls that are dropped, as what they compile or load is not a part of a query. Their number is fixed: shape matching
starts from where its last answer ended, so that the rounding of an answer depends on the calls before it."""
SLOW_S, SLOW_CALLS = 1.0, 5
"""Calls that take longer are repeated so often only."""

Call = Callable[[], object]


class Timed(NamedTuple):
    """The seconds of every timed call of each of n calls, and why each failed.

    failures : (n,) the NotConverged that a call raised, else None; a call that failed has no seconds
    """

    seconds: list[list[float]]
    failures: list[NotConverged | None]


class Timing(NamedTuple):
    """Seconds a call took over ``calls`` calls."""

    median_s: float
    p95_s: float
    calls: int


def time_calls(
    calls: Sequence[Call],
    repeats: int,
    budget_s: float = np.inf,
    receive: Callable[[int, Any], None] = lambda i, answer: None,
    warm_up: int = WARM_UP,
) -> Timed:
    """Time every one of ``calls`` once, and all in turn until ``repeats`` calls are made or ``budget_s`` [s] is over.

    calls : each is looked up anew before it is made, which is not timed
    receive : takes the number and the answer of every call, which is not timed
    warm_up : number of calls that are dropped before; where the first is slower than SLOW_S, each call is made once,
        and all together SLOW_CALLS times at most
    All run on one BLAS thread. A call for which it or ``receive`` raises NotConverged has failed and is not repeated.
    """
    from threadpoolctl import threadpool_limits

    count = len(calls)
    timed = Timed([[] for _ in range(count)], [None] * count)
    with threadpool_limits(limits=1):
        dropped = [_once(calls, i % count, lambda i, answer: None)[0] for i in range(warm_up)]
        limit = min(repeats, SLOW_CALLS) if dropped and dropped[0] > SLOW_S else repeats
        calls_made, began = 0, time.perf_counter()
        while calls_made < count or (calls_made < limit and time.perf_counter() - began < budget_s):
            i = calls_made % count
            calls_made += 1
            if timed.failures[i]:
                continue
            seconds, timed.failures[i] = _once(calls, i, receive)
            if timed.failures[i]:
                timed.seconds[i].clear()
            else:
                timed.seconds[i].append(seconds)
    return timed


def _once(calls: Sequence[Call], i: int, receive: Callable[[int, Any], None]) -> tuple[float, NotConverged | None]:
    """Return the seconds that call ``i`` takes, and the NotConverged that it or ``receive`` raises, or None."""
    start = time.perf_counter()
    try:
        call = calls[i]
        start = time.perf_counter()
        answer = call()
        seconds = time.perf_counter() - start
        receive(i, answer)
    except NotConverged as failure:
        return time.perf_counter() - start, failure
    return seconds, None


def said(failure: Exception) -> str:
    """Return the message of a failure in one line, which is never empty."""
    return str(failure).replace("\n", " ") or "not converged"


def measure(calls: Sequence[Call], repeats: int) -> Timing:
    """Time ``repeats`` calls of ``calls`` in turn; NotConverged if one fails.

    The results are median and 95th percentile, not mean and minimum: a surgeon's hand feels the frames that come late.
    """
    timed = time_calls(calls, repeats)
    if failed := next(filter(None, timed.failures), None):
        raise failed
    times = [seconds for each in timed.seconds for seconds in each]
    return Timing(float(np.median(times)), float(np.percentile(times, 95)), len(times))


def online(seconds: Sequence[Sequence[float]], name: str = "online") -> dict[str, float]:
    """Return median, 95th percentile and maximum of times as columns ``<name>_median_s`` …; none without times.

    seconds : of the calls of each question [s]; the maximum is that of the questions' medians
    """
    timed = [each for each in seconds if len(each)]
    if not timed:
        return {}
    calls = np.concatenate(timed)
    # a single late call is the machine's, a press that is late every time the model's
    largest = max(np.median(each) for each in timed)
    return {f"{name}_median_s": np.median(calls), f"{name}_p95_s": np.percentile(calls, 95), f"{name}_max_s": largest}


def processor_seconds(call: Call, least_s: float) -> float:
    """Return the mean processor time of this thread [s] for a call, over as many calls as take about ``least_s``."""
    timer = timeit.Timer(call, timer=time.thread_time)
    number = max(1, int(least_s / timer.timeit(number=1)))
    return timer.timeit(number=number) / number
