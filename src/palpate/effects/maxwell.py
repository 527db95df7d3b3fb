"""Maxwell elements: springs with relaxing rest length, parallel to the elastic springs."""

import math

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Relaxation
from palpate.effects.springs import Springs, direction


def make(particles: Particles, maxwell: settings.Maxwell, elastic: Springs) -> "Maxwell":
    """Make springs ``stiffness_ratio`` times as stiff as the elastic ones."""
    return Maxwell(elastic, maxwell.stiffness_ratio, maxwell.relaxation_s)


class Maxwell(Springs, Relaxation):
    """A spring in series with a damper (paper 3, chapter 3); the damper's length is the inner variable ``rest_m``, s.

    After each step s moves towards the present length l, by the exact solution of ds/dt = (l − s)/τ for constant l. So
    it dissipates energy, |l − s| never increases, and any step is stable. Trap: the body is stiffer against fast than
    against slow motion, and the longest stable explicit step is that of both springs together.
    """

    def __init__(self, springs: Springs, stiffness_ratio: float, relaxation_s: float):
        super().__init__(springs.pairs, stiffness_ratio * springs.stiffness_n_m, springs.rest_m.copy())
        self._relaxation_s = relaxation_s

    def relax(self, x: np.ndarray, h: float) -> None:
        _relax(x, self.pairs, -math.expm1(-h / self._relaxation_s), self.rest_m)


@numba.njit(cache=True)
def _relax(x, pairs, share, rest):
    n = np.empty(3)
    for e in range(len(pairs)):
        rest[e] += share * (direction(x, pairs[e], n) - rest[e])
