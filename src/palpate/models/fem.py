"""Corotational finite elements on one level of the body, stopped early or converged."""

import numpy as np

from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, checked

ITERATIONS = (1, 2, 4)
LOOSE = 1e-3
"""A relative residual whose error no hand would feel; the case's own tolerance is the tightest."""


def settings(case: Case, level: int) -> list[Setting]:
    """Caps on Newton's iterations, then tolerances; none where the body has no such level between coarse and fine."""
    if level == len(case.body.levels) - 1:
        return []
    return [{"iterations": n} for n in ITERATIONS] + [{"tolerance": LOOSE}, {"tolerance": case.tolerance}]


def prepare(case: Case, setting: Setting, level: int) -> "Fem":
    """Matrix patterns and the factor of the rest state."""
    return Fem(case, setting, level)


class Fem:
    """Finite elements of ``level`` (−1: fine), carried to the fine surface by linear interpolation."""

    def __init__(self, case: Case, setting: Setting, level: int):
        level %= len(case.body.levels)
        self._simulation = Simulation(case, level, **simulated(case, setting))
        self._up, self._n_surface = to_surface(case.body, level), case.n_surface

    @property
    def memory_mb(self) -> float:
        """What is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; NotConverged, InputError for a bad contact."""
        return checked(self._up @ self._simulation.displacement(contact, force), self._n_surface)


def simulated(case: Case, setting: Setting) -> dict:
    """What ``setting`` says of a simulation: iterations at most, or its tolerance."""
    return {"tolerance": setting.get("tolerance", case.tolerance), "iterations": setting.get("iterations")}
