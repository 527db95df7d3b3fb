"""Carry the answers of ever finer meshes to their limit, with what that limit may be off by (Richardson 1911).

Each halving of the elements divides the error by about the same ratio, which three levels show: one number for all
nodes, never changed. The lower it is, the less sure is the limit.
"""

import numpy as np

RATIOS = (2.2, 8.0)
"""Ratios of convergence between which a limit is believed, however far it is from the finest level: from the order 1.1
to the order 3 that quadratic elements have where the answer is smooth."""
SLOWEST = 1.3
"""The lowest ratio with which there is a limit to be seen. At the rim of held nodes the error falls by the order of 1,
a ratio of two, as displacements there grow with the root of the distance."""
RATIO_DOUBT = 0.25
"""By how much the ratio of all finer levels may be below the one that was found: on nailed organs it is 1.9 to 2.1."""


def ratio(levels: np.ndarray) -> float:
    """Return by how much the last halving has reduced the change, from the last three of ``levels`` (m, n, 3) [m].

    NaN where nothing changes.
    """
    before, last = (float(np.linalg.norm(levels[i] - levels[i - 1])) for i in (-2, -1))
    return before / last if last > 0.0 else float("nan")


def limit(levels: np.ndarray) -> np.ndarray:
    """Extrapolate the last three of ``levels`` (m, n, 3) [m] to their limit (n, 3) [m]; the last where none changes."""
    rate = ratio(levels)
    return levels[-1] if np.isnan(rate) else levels[-1] + (levels[-1] - levels[-2]) / (rate - 1.0)


def doubt(levels: np.ndarray) -> np.ndarray:
    """Return the vector (n, 3) [m] whose length says how far ``limit`` may be from the truth, from (m, n, 3) [m].

    With four levels it is the change of the limit from the first three to the last three, of which the last limit has
    a part only. With three it is the change from the limit of the first two to that of the last two, with the one ratio
    there is: what the scalar ratio leaves unexplained.
    """
    if len(levels) > 3:
        return limit(levels) - limit(levels[:-1])
    first, last = levels[-2] - levels[-3], levels[-1] - levels[-2]
    rate = ratio(levels)
    return np.zeros_like(last) if np.isnan(rate) else (rate * last - first) / (rate - 1.0)


def estimate(levels: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Return the best answer (n, 3) [m] that ``levels`` (m, n, 3) [m] show, and vectors as long as its own errors.

    The limit may be off by ``doubt``, and by what a ratio that is lower by RATIO_DOUBT would change of it, which grows
    as the ratio falls. Where no limit is to be seen, the finest level is the answer: it may be off by its last change
    if levels close in quickly, and by what is left at the ratio SLOWEST if they hardly do.
    """
    rate, last = ratio(levels), levels[-1] - levels[-2]
    if SLOWEST <= rate <= RATIOS[1]:
        return limit(levels), (doubt(levels), RATIO_DOUBT / (rate - 1.0) ** 2 * last)
    return levels[-1], (last / (SLOWEST - 1.0) if rate < SLOWEST else last,)


def number_ratio(levels: np.ndarray) -> float:
    """Return by how much the last halving has reduced the change of a number (3,), negative if it has turned."""
    before, last = levels[1] - levels[0], levels[2] - levels[1]
    return float(before / last) if last else np.inf


NUMBER_RATIOS = (1.8, 18.0)
"""Ratios of the changes of a number between which its limit is believed."""


def number_limits(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (k,) of numbers on three meshes (3, k), and how far each may be off.

    Where the changes of one shrink as they do for an order of 1 to 4, it is extrapolated and may be off by as much as
    that has changed it. Elsewhere it is that of the finest mesh, and may be off by the larger of the last change and a
    third of the one before.
    """
    limits, off = np.array([_number_limit(each) for each in levels.T]).T
    return limits, off


def _number_limit(levels: np.ndarray) -> tuple[float, float]:
    rate, last = number_ratio(levels), levels[2] - levels[1]
    if NUMBER_RATIOS[0] <= rate <= NUMBER_RATIOS[1]:
        more = last / (rate - 1.0)
        return float(levels[2] + more), float(abs(more))
    return float(levels[2]), float(max(abs(last), abs(levels[1] - levels[0]) / 3.0))
