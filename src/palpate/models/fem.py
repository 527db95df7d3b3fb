"""Answer with corotational finite elements on one level of the body, stopped early or converged."""

import numpy as np

from palpate.models.fem_statics import Simulation, solver_options, to_surface
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, distinct


def settings(case: Case, level: int) -> list[Setting]:
    """List caps on Newton's iterations, then tolerances; none where the body has no middle level."""
    if level == len(case.body.levels) - 1:
        return []
    grid = case.grid["fem"]
    capped = [{"iterations": n} for n in grid["iterations"]]
    return distinct([*capped, *({"tolerance": tolerance} for tolerance in (*grid["tolerances"], case.tolerance))])


def prepare(case: Case, setting: Setting, level: int) -> "Fem":
    """Make matrix patterns and the factor of the rest state."""
    return Fem(case, setting, level)


class Fem:
    """Finite elements of ``level`` (−1: fine), brought to the fine surface by linear interpolation."""

    def __init__(self, case: Case, setting: Setting, level: int):
        level %= len(case.body.levels)
        self._simulation = Simulation(case, level, **solver_options(case, setting))
        self._up = to_surface(case.body, level)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N]; errors as ``Solver``."""
        return self._up @ self._simulation.displacement(contact, force)
