"""Extrapolate answers on nested meshes to the limit of ever finer ones, and estimate how far that is from the truth.

Each halving of the elements divides the error by about the same ratio, which three levels show (Richardson 1911). The
ratio is one number for all nodes, and is never changed: where it is not that of a convergent method, the answer is not
to be used, and the caller has to say so.
"""

import numpy as np

RATIOS = (2.2, 8.0)
"""Ratios of convergence between which a limit is believed: from the order 1.1, near what an anchor's edge leaves, to
the order 3 that quadratic elements have where the answer is smooth."""


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
