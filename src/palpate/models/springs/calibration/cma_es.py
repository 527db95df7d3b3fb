"""CMA-ES, a rival of the genetic algorithm, from the library ``cma``."""

from collections.abc import Callable

import numpy as np

from palpate.models.springs.calibration.fitness import LANES, Fit, Range, Track

INITIAL_SIGMA = 0.3
"""Standard deviation of the first individuals, in log E: a factor of 1.35."""


def cma_es(
    fitness: Callable[[np.ndarray], np.ndarray],
    start_pa: np.ndarray,
    limits: Range,
    evaluations: int,
    seed: int,
    report: Callable[[int, float], None] = lambda evaluations, best: None,
) -> Fit:
    """Search from moduli ``start_pa`` (n,) [Pa] in log E, until ``evaluations`` individuals or the library's own end.

    A generation has as many as are advanced together; the library would take 4 + 3 log n, 18 on paper 2's cube.
    Hansen 2016; Hansen, Akimoto, Baudis 2019 (pycma). Trap: the library replaces the seed 0 by the time of day.
    """
    import cma

    options = {
        "seed": seed + 1,
        "bounds": [float(np.log(limits.low_pa)), float(np.log(limits.high_pa))],
        "maxfevals": evaluations,
        "popsize": len(LANES),
        "verbose": -9,
    }
    track = Track(fitness)
    search = cma.CMAEvolutionStrategy(np.log(start_pa), INITIAL_SIGMA, options)
    while not search.stop():
        candidates = search.ask()
        search.tell(candidates, (-track(np.exp(np.array(candidates)))).tolist())
        report(len(track.history), track.best)
    return track.fit()
