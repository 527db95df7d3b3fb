"""Corotational finite elements on one level of the body, stopped early or converged."""

import numpy as np

from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.memory import held_mb
from palpate.models.model import Case, Knob, checked

ITERATIONS = (1, 2, 4)
LOOSE = 1e-3
"""A relative residual whose error no hand would feel; the case's own tolerance is the tightest."""


def knobs(case: Case, level: int) -> list[Knob]:
    """Caps on Newton's iterations, then tolerances; none where the body has no such level between coarse and fine."""
    if level == len(case.body.levels) - 1:
        return []
    return [{"iterations": n} for n in ITERATIONS] + [{"tolerance": LOOSE}, {"tolerance": case.tolerance}]


def prepare(case: Case, knob: Knob, level: int) -> "Fem":
    """Matrix patterns and the factor of the rest state."""
    return Fem(case, knob, level)


class Fem:
    """Finite elements of ``level`` (−1: fine), carried to the fine surface by linear interpolation."""

    def __init__(self, case: Case, knob: Knob, level: int):
        level %= len(case.body.levels)
        self._simulation = Simulation(case, level, **simulated(case, knob))
        self._up, self._n_surface = to_surface(case.body, level), case.n_surface

    @property
    def memory_mb(self) -> float:
        """What is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; NotConverged, InputError for a bad contact."""
        return checked(self._up @ self._simulation.displacement(contact, force), self._n_surface)


def simulated(case: Case, knob: Knob) -> dict:
    """What ``knob`` says of a simulation: iterations at most, or its tolerance."""
    return {"tolerance": knob.get("tolerance", case.tolerance), "iterations": knob.get("iterations")}
