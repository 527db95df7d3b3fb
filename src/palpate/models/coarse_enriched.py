"""Combine a coarse simulation with a method that makes a fine answer of it, as all models that learn from it do."""

import numpy as np

from palpate.enrichment.fit_inputs import Fitting, Method
from palpate.models.fem_statics import LinearCoarse, Simulation
from palpate.models.memory import held_mb
from palpate.models.model import Case


class Enriched:
    """``method`` on top of the coarse ``simulation``; both are part of what a query costs."""

    def __init__(self, method: Method, simulation: Simulation | LinearCoarse):
        self._method, self._simulation = method, simulation

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N]; errors as ``Solver``."""
        return self._method.predict(self._simulation.displacement(contact, force), contact, force)


def coarse_simulation(case: Case) -> Simulation:
    """Simulate the coarse mesh as for the samples of the database."""
    return Simulation(case, 0, case.tolerance)


def fitting_to(case: Case) -> Fitting:
    """Return what a method is fitted to: all training samples of ``case``, of the live protocol.

    InputError where they are too few to divide into folds.
    """
    db = case.use_training()
    return Fitting.of(db, np.arange(len(db.contact)), "live", case.options)
