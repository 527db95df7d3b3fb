"""Continuation: reach a load or a depth in steps, each from the state before it; a step that fails is halved."""

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from palpate.errors import NotConverged

State = TypeVar("State")
SHORTEST = 1.0 / 64.0
"""Shortest step, as a fraction of the whole path."""


def steps_to(
    end: float,
    reached: float,
    whole: float,
    state: State,
    solve: Callable[[State, float, float], State],
    describe: Callable[[float, float], str],
    longest: float = np.inf,
    stay_short: bool = False,
) -> Iterator[tuple[float, State]]:
    """Go along a path parameter from ``reached`` to ``end``, and yield the parameter and the state after each step.

    whole : length of the path, of which no step may be less than SHORTEST; longest : the longest step that is tried
    solve : from the state before a step, the parameter at its end, and its length to the state at its end
    describe : from the same parameter and length to the words in which an error names the step
    stay_short : whether steps after one that was halved are as short; else each next one is tried up to ``end``
    A step for which ``solve`` raises NotConverged is halved, and the error is raised again once a step is too short.
    """
    step = 0.0
    while True:
        if not (stay_short and step):
            step = end - reached
            step /= max(float(np.ceil(abs(step) / longest - 1e-9)), 1.0) if step else 1.0
        while True:
            try:
                state = solve(state, reached + step, step)
                break
            except NotConverged as failure:
                step *= 0.5
                if abs(step) < SHORTEST * whole:
                    failed = describe(reached + 2.0 * step, 2.0 * step)
                    raise NotConverged(f"{failure}, {failed}", failure.history) from failure
        reached += step
        yield reached, state
        if abs(reached - end) <= 1e-12 * whole:
            return
