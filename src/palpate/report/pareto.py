"""Pareto front: methods that no other beats in both time and error."""

import numpy as np


def front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Find the indices of the non-dominated points, in order of rising cost.

    cost, error : (n,), both to be small; a point that is not finite is never on the front.
    A point is dominated if another is at least as good in both and better in one; equal points are all kept.
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
