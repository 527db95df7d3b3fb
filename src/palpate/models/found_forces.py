"""Find the forces under which discs move as far as they are pushed."""

from collections.abc import Callable

import numpy as np

from palpate.errors import NotConverged

CLOSE, MOST = 1e-4, 40
"""What may be left, over the largest displacement that is asked for, and the most evaluations."""


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
    """
    force, inverse = force.copy(), np.linalg.inv(slope[np.ix_(unknown, unknown)])
    scale = float(np.abs(wanted[unknown]).max()) or 1.0
    left = _left(moved, force, wanted, unknown)
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
