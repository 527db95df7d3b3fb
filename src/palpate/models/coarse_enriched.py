"""A coarse simulation, and a method that makes a fine answer of it: all that learns from samples is asked this way."""

import numpy as np

from palpate.enrichment.methods import Method
from palpate.enrichment.training_samples import Training, gather
from palpate.models.fem_statics import Simulation
from palpate.models.memory import held_mb
from palpate.models.model import Case, checked
from palpate.samples.database import Database

SHARES = (0.25, 0.4, 0.6, 0.8, 1.0)
"""Of the training samples, where their number is the setting."""


class Enriched:
    """``method`` on top of the coarse ``simulation``; both are part of what a query costs."""

    def __init__(self, case: Case, method: Method, simulation: Simulation):
        self._method, self._simulation, self._n_surface = method, simulation, case.n_surface

    @property
    def memory_mb(self) -> float:
        """What is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; NotConverged, InputError for a bad contact."""
        coarse = self._simulation.displacement(contact, force)
        return checked(self._method.predict(coarse, contact, force), self._n_surface)


def coarse_simulation(case: Case) -> Simulation:
    """The coarse mesh, simulated as for the samples of the database."""
    return Simulation(case, 0, case.tolerance)


def learnt_from(case: Case) -> tuple[Database, Training]:
    """All samples of ``case``, with the folds that choose settings; InputError where they are too few to divide."""
    db = case.training
    return db, gather(db, np.arange(len(db.contact)), "live", case.options)


def sample_counts(case: Case) -> list[int]:
    """SHARES of the training samples, each a whole number and none twice."""
    return sorted({max(4, round(share * case.n_training)) for share in SHARES})
