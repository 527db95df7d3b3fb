"""Static equilibrium without matrices of the deformed body: L-BFGS first, Newton's method where that does not serve."""

from collections.abc import Callable

import numpy as np

from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.lbfgs import Descent, always, descend
from palpate.solvers.newton import Solution

MOST = 60
"""Iterations of L-BFGS after which Newton's method takes over; 10 to 30 do where nothing is wrong."""
PACE, WINDOW = 0.1, 12
"""In so many iterations the residual has to fall to this share of what it was, or Newton's method is faster."""


class FastEquilibrium(Equilibrium):
    """Equilibrium of quadratic elements: an iteration is one pass over them and one cycle of multigrid at rest.

    Newton's method assembles a stiffness and needs as many cycles for each of its iterations as L-BFGS in all. It is
    the fallback: from where L-BFGS has come to if that is slow, and from the start if it has met a place where the
    energy is not convex, at which the two may go different ways.
    In a ``Solution`` of it each iteration counts as one product.
    """

    def solve(self, load: np.ndarray, tolerance: float, start: np.ndarray | None = None) -> Solution:
        """Find the equilibrium under ``load`` (n_nodes, 3) [N], as ``Equilibrium.solve`` does; the same errors."""
        newton = super().solve
        return self.descend_or(lambda begin: newton(load, tolerance, begin), load, tolerance, start)

    def descend_or(
        self,
        otherwise: Callable[[np.ndarray | None], Solution],
        load: np.ndarray,
        tolerance: float,
        start: np.ndarray | None,
    ) -> Solution:
        """Find the equilibrium by L-BFGS, or by what is done ``otherwise``, whose errors it raises.

        otherwise : from the positions to start at, None for rest, to a solution
        """
        scale = self._scale(load)
        if scale == 0.0:
            return Solution(self.mesh.nodes.copy(), [0.0], [0.0])
        way = self._descend(load, tolerance * scale, start, MOST, _is_worth_it)
        if way.forces[-1] <= tolerance * scale and way.convex:
            return _solution(way, scale)
        return _after(way, scale, otherwise(way.x if way.convex else start))

    def approach(
        self, load: np.ndarray, tolerance: float, iterations: int, start: np.ndarray | None = None
    ) -> Solution:
        """Do at most ``iterations`` of L-BFGS under the full ``load``, otherwise as ``Equilibrium.approach``.

        The result has at most the energy of the start.
        """
        scale = self._scale(load)
        if scale == 0.0:
            return Solution(self.mesh.nodes.copy(), [0.0], [0.0])
        return _solution(self._descend(load, tolerance * scale, start, iterations), scale)

    def _descend(
        self,
        load: np.ndarray,
        enough: float,
        start: np.ndarray | None,
        iterations: int,
        goes_on: Callable[[Descent], bool] = always,
    ) -> Descent:
        self._load = load
        begin = self.mesh.nodes if start is None else start
        return descend(self, self._precondition, begin, enough, iterations, goes_on)

    def _scale(self, load: np.ndarray) -> float:
        return float(np.linalg.norm(load[~self._held]))


def _is_worth_it(way: Descent) -> bool:
    return way.convex and (len(way.forces) <= WINDOW or way.forces[-1] <= PACE * way.forces[-1 - WINDOW])


def _solution(way: Descent, scale: float) -> Solution:
    return Solution(way.x, [force / scale for force in way.forces], way.seconds, products=len(way.forces) - 1)


def _after(way: Descent, scale: float, newton: Solution) -> Solution:
    """Return Newton's solution with what was spent before it."""
    spent = _solution(way, scale)
    newton.history = spent.history[:-1] + newton.history
    newton.seconds = spent.seconds[:-1] + [spent.seconds[-1] + each for each in newton.seconds]
    newton.products += spent.products
    return newton
