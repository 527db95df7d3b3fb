"""Find the forces under which discs move as far as they are pushed."""

from collections.abc import Callable

import numpy as np

from palpate.benchmark.load import Refused
from palpate.errors import NotConverged

CLOSE, MOST = 1e-4, 40
"""What may be left, over the largest displacement that is asked for or undone, and the most evaluations."""
WORST = 1e12
"""Condition of the responses of discs above which they are the same one."""


def forces_for(
    moved: Callable[[np.ndarray], np.ndarray],
    wanted: np.ndarray,
    force: np.ndarray,
    unknown: np.ndarray,
    slope: np.ndarray,
) -> np.ndarray:
    """Return forces (f,) [N] at which ``moved`` (f,) [m] is ``wanted`` (f,) where ``unknown`` (f,) says so.

    force : (f,) the given ones, and 0 where they are unknown; slope : (f, f) [m/N], the response to small forces
    Broyden's method (1965), from the linear response, with steps cut where they lead no nearer.
    Refused for two discs that are pushed at the same place.
    """
    gives = slope[np.ix_(unknown, unknown)]
    if not np.linalg.cond(gives) < WORST:
        raise Refused("two discs are pushed to a depth at the same place; push one of them")
    force, inverse = force.copy(), np.linalg.inv(gives)
    left = _left(moved, force, wanted, unknown)
    # a disc that is held where other presses would move it has a way to go, too
    scale = float(max(np.abs(wanted[unknown]).max(), np.abs(left).max()))
    step = inverse @ left
    for _ in range(MOST):
        if np.abs(left).max() <= CLOSE * scale:
            return force
        tried = force.copy()
        tried[unknown] += step
        try:
            found = _left(moved, tried, wanted, unknown)
        except NotConverged:
            step = 0.5 * step
            continue
        if not np.linalg.norm(found) < 1.5 * np.linalg.norm(left):
            step = 0.5 * step
            continue
        change = inverse @ (left - found)
        inverse += np.outer(step - change, step @ inverse) / (step @ change)
        force, left = tried, found
        step = inverse @ left
    raise NotConverged("no force was found that moves the disc as far as it is pushed", [float(np.abs(left).max())])


def _left(
    moved: Callable[[np.ndarray], np.ndarray], force: np.ndarray, wanted: np.ndarray, unknown: np.ndarray
) -> np.ndarray:
    return (wanted - moved(force))[unknown]
