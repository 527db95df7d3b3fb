"""The goal-position integrator of shape matching: explicit, and stable for any step."""

from functools import cached_property

import numba
import numpy as np

from palpate.effects.effect import Goals, offers
from palpate.effects.settings import Stepping
from palpate.errors import InputError, NotConverged
from palpate.solvers.system import System, stable_step


def make(system: System, stepping: Stepping | None = None) -> "GoalPosition":
    """Make the integrator, which has no settings; InputError if the elastic effect has no goals."""
    if not offers(system.elastic, Goals):
        raise InputError("it needs an elastic effect with goals; choose shape_matching, or another integrator.")
    return GoalPosition(system, system.elastic.alpha)


class GoalPosition:
    """A step: v' = v + α (g − x)/h + h f/m, then x' = x + h v' (paper 3, chapter 3), then the projections of effects.

    For a particle with a fixed goal a step is the matrix [[1, −α/h], [h, 1 − α]] with the eigenvalues
    (1 − α/2) ± sqrt(α² − 4α)/2. Their product is 1, and for α ≤ 1 they are conjugate, so their modulus is 1 for any h.
    Other forces that grow with x or v, such as springs and damping, limit the step again; contact, which is projected,
    does not. Traps: the stiffness α m/h² depends on the step; without damping no motion ends, even with α = 1. Where
    goals jump, as rotations do if a body starts random, flat or inverted, they may add energy: without damping,
    amplitudes reach tens of times the body's size within some thousand steps and continue to grow slowly. A loss of
    5 % of the velocity in each step keeps them within three times the initial one, and the body always recovers.
    """

    def __init__(self, system: System, alpha: float):
        self._system, self._alpha = system, alpha
        self._mobility = system.inverse_masses
        self._goals = np.zeros((len(system.masses), 3))

    @cached_property
    def limit_s(self) -> float:
        """The longest step [s] that is stable for the other forces; infinite if none of them grows with x or v."""
        return stable_step(self._system, taken=self._alpha)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        system = self._system
        force = system.explicit_force(x, v)
        load = system.outer_force(x, v) if system.loaded else None
        start, x, v = x, x.copy(), v.copy()
        system.goals(x, self._goals)
        _advance(x, v, self._goals, force, self._mobility, system.free, self._alpha, h)
        system.project(start, x, v, h)
        if load is not None:
            system.add_work(load, x - start)
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise NotConverged("goal position is not finite any more; a force grows with x or v: lower it", [])
        return x, v


@numba.njit(cache=True)
def _advance(x, v, goals, force, mobility, free, alpha, h):
    for n in range(len(x)):
        for i in range(3):
            v[n, i] += alpha * (goals[n, i] - x[n, i]) / h + h * mobility[n] * force[n, i]
            if not free[n]:
                v[n, i] = 0.0
            x[n, i] += h * v[n, i]
