"""The goal-position scheme of shape matching: explicit, and stable for every step."""

from functools import cached_property

import numba
import numpy as np

from palpate.errors import InputError, NotConverged
from palpate.solvers.stable_step import stable_step
from palpate.solvers.system import System


def make(system: System, settings: dict) -> "GoalPosition":
    """The integrator; it has no settings. InputError if the elastic effect gives no goals."""
    if not hasattr(system.elastic, "goals"):
        raise InputError("it needs an elastic effect with goals; choose shape_matching, or another integrator.")
    return GoalPosition(system)


class GoalPosition:
    """v' = v + α (g − x)/h + h f/m, then x' = x + h v' (paper 3, chapter 3), then what effects project.

    For a particle with a goal at rest this is the matrix [[1, −α/h], [h, 1 − α]] of eigenvalues
    (1 − α/2) ± sqrt(α² − 4α)/2: their product is 1 and they are conjugate for α ≤ 1, so of modulus 1 whatever h
    is. Other forces that grow with x or v, such as springs and damping, bring back a limit; contact, which is
    projected, does not. Traps: the stiffness α m/h² depends on the step; without damping nothing comes to rest, even
    with α = 1. Where goals jump, as rotations do when a body starts scrambled, flat or inverted, that may add energy:
    undamped, swings reach tens of times the body's size in some thousand steps and go on growing slowly. Losing a
    twentieth of the velocity a step keeps them within three times the start's, and brings every start back.
    """

    def __init__(self, system: System):
        self._system = system
        self._mobility = np.where(system.free, 1.0 / np.where(system.free, system.masses, 1.0), 0.0)
        self._goals = np.zeros((len(system.masses), 3))

    @cached_property
    def limit_s(self) -> float:
        """The largest step [s] that is stable for the forces besides the goals; inf if none of them grows."""
        return stable_step(self._system, taken=self._system.elastic.alpha)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; NotConverged if not finite."""
        system = self._system
        force = system.explicit_force(x, v)
        start, x, v = x, x.copy(), v.copy()
        system.goals(x, self._goals)
        _advance(x, v, self._goals, force, self._mobility, system.free, system.elastic.alpha, h)
        system.project(start, x, v, h)
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise NotConverged("goal position has left the finite numbers; a force grows with x or v: lower it", [])
        return x, v


@numba.njit(cache=True)
def _advance(x, v, goals, force, mobility, free, alpha, h):
    for n in range(len(x)):
        for i in range(3):
            v[n, i] += alpha * (goals[n, i] - x[n, i]) / h + h * mobility[n] * force[n, i]
            if not free[n]:
                v[n, i] = 0.0
            x[n, i] += h * v[n, i]
