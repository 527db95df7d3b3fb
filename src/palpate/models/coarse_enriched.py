"""Combine a coarse answer with a method that makes a fine one of it, as all models that learn from it do."""

import numpy as np

from palpate.enrichment.fit_inputs import Method
from palpate.models.fem_statics import LinearCoarse, Simulation
from palpate.models.memory import held_mb


class Enriched:
    """``method`` on top of the ``coarse`` answer; both are part of what a query costs."""

    def __init__(self, method: Method, coarse: Simulation | LinearCoarse):
        self._method, self._coarse = method, coarse

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N]; errors as ``Solver``."""
        return self._method.predict(self._coarse.displacement(contact, force), contact, force)
