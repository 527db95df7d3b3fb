"""Symplectic Euler: one evaluation of the forces in each step, no linear system, and a longest stable step."""

from functools import cached_property

import numpy as np

from palpate.effects.effect import Force, offers
from palpate.effects.settings import Stepping
from palpate.errors import InputError, NotConverged
from palpate.solvers.system import System, stable_step


def make(system: System, stepping: Stepping | None = None) -> "SymplecticEuler":
    """Make the integrator, which has no settings; InputError if the elastic effect has no force."""
    if not offers(system.elastic, Force):
        raise InputError("it needs an elastic effect with a force; with shape_matching choose goal_position.")
    return SymplecticEuler(system)


class SymplecticEuler:
    """A step: v' = v + h f(x, v)/m, then x' = x + h v', then the projections of effects (paper 3, chapter 3).

    Without damping and loads it conserves linear and angular momentum, and its energy does not drift (Hairer, Lubich,
    Wanner 2006, chapter IX). Trap: beyond ``limit_s`` it diverges.
    """

    def __init__(self, system: System):
        self._system = system
        self.renew()

    def renew(self) -> None:
        """Take the masses that the system has now."""
        self._mobility = self._system.inverse_masses[:, None]

    @cached_property
    def limit_s(self) -> float:
        """The longest step [s] that is stable at the rest state; a stretched body may need a shorter one."""
        return stable_step(self._system)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        load = self._system.outer_force(x, v) if self._system.loaded else None
        v = v + h * self._mobility * self._system.explicit_force(x, v)
        v[~self._system.free] = 0.0
        start, x = x, x + h * v
        self._system.project(start, x, v, h)
        if load is not None:
            self._system.add_work(load, x - start)
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise NotConverged("symplectic Euler has diverged; take a shorter step or an implicit integrator", [])
        return x, v
