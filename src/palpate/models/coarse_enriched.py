"""Combine a coarse answer with a method that makes a fine one of it, as all models that learn from it do."""

import numpy as np

from palpate.benchmark.load import Load, Refused
from palpate.models.enrichment.fit_inputs import Method
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

    def respond(self, load: Load) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under one force at a coarse node; errors as ``Solver``."""
        contact, force = load.single()
        moved = self._coarse.displacement(load)
        if contact >= len(moved):
            raise Refused("presses at nodes of the coarse mesh are answered, which samples press, and not at others")
        return self._method.predict(moved, contact, force)
