"""Least error that springs can reach: fitted to all presses, for references of several Poisson ratios."""

import numpy as np
import pandas as pd

from palpate.models.springs.descent import descend_with_volume
from palpate.models.springs.fitness import Fit
from palpate.studies.springs.spring_experiment import Experiment, Motion
from palpate.studies.springs.spring_fit import Budget, Fitted, find, judge

INCOMPRESSIBLE = 0.49
"""Poisson ratio of the stiffest volume force that a fit may choose."""


def measure(found: Experiment, references: dict[str, Motion], stiffest_n_m: float, evaluations: int) -> pd.DataFrame:
    """Measure the rows of spring_floor.csv for one Poisson ratio: each press, without and with a volume force.

    stiffest_n_m : upper bound [N/m] of the volume force's stiffness, which is fitted together with the moduli
    The springs are fitted to all presses, so that the error is the least possible one and not that of a fit to one
    press.
    """
    budget = Budget(population=0, generations=0, cma_es_evaluations=0, gradient_evaluations=evaluations)
    alone = find("gradient_all", found, [found.fitness(press, references) for press in references], budget, seed=0)
    fit, stiffness = _with_volume(found, references, alone.fit.young, stiffest_n_m, evaluations)
    cases = ((found, alone, False), (found.with_volume(stiffness), Fitted(found.model, fit), True))
    tables = [
        judge(trial, fitted, references, list(references)).assign(
            volume_force=force, volume_n_m=trial.settings.volume_n_m, poisson=found.particles.material.poisson
        )
        for trial, fitted, force in cases
    ]
    names = "poisson volume_force volume_n_m press rmse_m rmse_of_peak max_x_m max_y_m max_z_m fitness"
    return pd.concat(tables)[names.split()]


def _with_volume(
    found: Experiment, references: dict[str, Motion], alone: np.ndarray, stiffest_n_m: float, evaluations: int
) -> tuple[Fit, float]:
    """Fit from the material's volume force, and from none with the best moduli ``alone``; keep the better fit.

    So a volume force cannot seem to increase the error only because a descent ended too early.
    """
    starts = ((found.start(), min(found.volume_n_m(), stiffest_n_m)), (alone, 0.0))
    ends = []
    for young, stiffness in starts:
        trial = found.with_volume(stiffness)
        fitnesses = [trial.fitness(press, references) for press in references]
        ends.append(descend_with_volume(fitnesses, young, found.limits, evaluations, stiffest_n_m))
    return max(ends, key=lambda end: end[0].fitness)
