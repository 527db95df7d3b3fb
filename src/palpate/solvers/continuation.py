"""Go to a load or a depth in steps, each from the state that the last one has found; one that finds none is halved."""

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from palpate.errors import NotConverged

State = TypeVar("State")
SHORTEST = 1.0 / 64.0
"""Least step over the whole way."""


def steps_to(
    end: float,
    reached: float,
    whole: float,
    state: State,
    move: Callable[[State, float, float], State],
    told: Callable[[float, float], str],
    most: float = np.inf,
    wary: bool = False,
) -> Iterator[tuple[float, State]]:
    """Go from where is ``reached`` to an ``end`` in steps of at most ``most``, and yield place and state of each.

    move : from the state before a step, the place at its end, and the step to the state there
    told : from place and step to what is said where none is found
    wary : whether steps stay as short as they had to be; otherwise all that is left is tried again after each
    A step for which ``move`` raises NotConverged is halved; that is raised where it is below SHORTEST of the ``whole``.
    """
    step = 0.0
    while True:
        if not (wary and step):
            step = end - reached
            step /= max(float(np.ceil(abs(step) / most - 1e-9)), 1.0) if step else 1.0
        while True:
            try:
                state = move(state, reached + step, step)
                break
            except NotConverged as failure:
                step *= 0.5
                if abs(step) < SHORTEST * whole:
                    where = told(reached + 2.0 * step, 2.0 * step)
                    raise NotConverged(f"{failure}, {where}", failure.history) from failure
        reached += step
        yield reached, state
        if abs(reached - end) <= 1e-12 * whole:
            return
