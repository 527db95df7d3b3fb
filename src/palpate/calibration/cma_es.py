"""Rival of the genetic algorithm: CMA-ES, from the library ``cma``."""

from collections.abc import Callable

import numpy as np

from palpate.calibration.fitness import Fit, Range, Track

SPREAD = 0.3
"""Standard deviation of the first individuals, in log E: a factor of 1.35."""


def cma_es(
    fitness: Callable[[np.ndarray], np.ndarray],
    start_pa: np.ndarray,
    limits: Range,
    evaluations: int,
    seed: int,
    report: Callable[[int, float], None] = lambda evaluations, best: None,
) -> Fit:
    """Search from moduli ``start_pa`` (n,) [Pa] in log E, until ``evaluations`` individuals or a sure end.

    Hansen 2016; Hansen, Akimoto, Baudis 2019 (pycma). Trap: the library takes the seed 0 for the time of day.
    """
    import cma

    options = {
        "seed": seed + 1,
        "bounds": [float(np.log(limits.low_pa)), float(np.log(limits.high_pa))],
        "maxfevals": evaluations,
        "verbose": -9,
    }
    track = Track(fitness)
    search = cma.CMAEvolutionStrategy(np.log(start_pa), SPREAD, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, (-track(np.exp(np.array(asked)))).tolist())
        report(len(track.history), track.best)
    return track.fit()
