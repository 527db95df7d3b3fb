"""BDF2: each step follows from two before it. It is of second order and stable for any step, but may add energy."""

import numpy as np

from palpate.effects.settings import Stepping
from palpate.errors import NotConverged
from palpate.solvers import backward_euler
from palpate.solvers.backward_euler import BackwardEuler
from palpate.solvers.system import System


def make(system: System, stepping: Stepping) -> "Bdf2":
    """Make the integrator; InputError for an effect whose force it could not include in the minimisation."""
    backward_euler.check(system)
    return Bdf2(system, stepping.tolerance)


class Bdf2(BackwardEuler):
    """A step: v' = (3x' − 4x + x₋)/2h, M (3v' − 4v + v₋)/2h = f(x', v'), with the state (x₋, v₋) of the step before.

    With y = (4x − x₋)/3 and w = (4v − v₋)/3 that is v' = (x' − y)/a and M (v' − w)/a = f, the step of backward Euler
    from (y, w) over a = 2h/3, so x' is found by the same minimisation (Hairer and Wanner 1996, section V.1; Gear
    1971). Damping matrix and loads are those at 2x − x₋, where the step ends to second order. The first step, and one
    that is not found, are backward Euler's, in halves if need be.

    Trap: the proof that no step of backward Euler makes energy does not carry over. BDF2 damps far less, and where the
    energy is not convex or something is touched, a step may gain some; nothing is scaled down. Each run's
    energy.csv says how much.
    """

    def __init__(self, system: System, tolerance: float):
        super().__init__(system, tolerance)
        self._history: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float] | None = None

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; NotConverged if none is found.

        A state other than that which the last step returned, or another ``h``, begins a new motion.
        """
        reached, velocity = self._second(x, v, h) or super().step(x, v, h)
        self._history = x, v, reached, velocity, h
        return reached, velocity

    def _second(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return x' and v' of a step from (y, w) over a; None if none is found, or the last step did not end here."""
        if self._history is None:
            return None
        x_before, v_before, x_last, v_last, h_last = self._history
        if h_last != h or not (np.array_equal(x, x_last) and np.array_equal(v, v_last)):
            return None
        y, w, a = x + (x - x_before) / 3.0, v + (v - v_before) / 3.0, 2.0 * h / 3.0
        try:
            carried = self._system.begin(x, h)
            reached, load = self.least(y, w, a, carried, 2.0 * x - x_before)
        except NotConverged:
            return None
        self._system.add_work(load, reached - x)
        self._system.end(reached)
        return reached, (reached - y) / a
