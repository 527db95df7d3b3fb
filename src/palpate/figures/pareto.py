"""Which methods no other beats in both time and error."""

import numpy as np


def front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Indices of the non-dominated points, cheapest first.

    cost, error : (n,) to be small both; a point that is not finite is never on the front.
    A point is dominated if another is no worse in both and better in one; equal points are all kept.
    """
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    kept, best, best_cost = [], np.inf, np.inf
    for i in np.lexsort((error, cost)):
        if not (np.isfinite(cost[i]) and np.isfinite(error[i])):
            continue
        if error[i] < best or (error[i] == best and cost[i] == best_cost):
            kept.append(i)
            best, best_cost = error[i], cost[i]
    return np.array(kept, dtype=int)
