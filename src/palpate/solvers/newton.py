"""Newton's method for the minimum of a potential energy, with line search and inexact linear solves."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.krylov import conjugate_gradients

Product = Callable[[np.ndarray], np.ndarray]


CUT, STALL = 0.02, 3
"""Steps in a row that may have to be cut below this part: more, and the energy is not smooth where x has come."""


class Problem(Protocol):
    """What Newton's method minimises; all arrays are (n_nodes, 3)."""

    def energy(self, x: np.ndarray) -> float:
        """Potential energy of inner and outer forces [J]."""

    def force(self, x: np.ndarray) -> np.ndarray:
        """Minus the energy's gradient [N], zero at held nodes."""

    def linearise(self, x: np.ndarray, definite: bool) -> tuple[Product, Product]:
        """Products with the Hessian, clamped if ``definite``, and with a preconditioner for it."""


class Bounded(Problem, Protocol):
    """A problem whose steps may have to end early, as bodies would go through each other."""

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        """How far along ``direction`` a step from ``x`` may lead, in parts of it; inf where nothing is in the way."""


@dataclass
class Solution:
    """Where Newton's method ended, and what it took.

    x : (n_nodes, 3) [m]
    history : relative residual before each iteration and at the end; ``seconds`` when each was known
    """

    x: np.ndarray
    history: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    linear_solves: int = 0
    products: int = 0

    @property
    def iterations(self) -> int:
        return len(self.history) - 1


def minimise(
    problem: Problem,
    x: np.ndarray,
    scale: float,
    tolerance: float,
    max_iterations: int = 60,
    solution: Solution | None = None,
) -> Solution:
    """Find x with ‖force(x)‖ ≤ ``tolerance`` · ``scale`` [N], starting from ``x``.

    The exact Hessian is tried first; where conjugate gradients meet negative curvature its clamped form gives
    a descent direction instead. Steps are halved until the energy falls enough (Armijo). Linear systems are
    solved only as well as the progress warrants (Eisenstat and Walker 1996, choice 2). Where the problem is Bounded
    no step goes beyond its limit.

    solution : of earlier attempts, to be continued: what this one takes is added, also where it fails

    Raises NotConverged, with the history of relative residuals, when the iterations are used up, the energy
    stops falling, or a value stops being finite.
    """
    solution = solution or Solution(x)
    solution.x, first = x, len(solution.history)
    start = perf_counter() - (solution.seconds[-1] if first else 0.0)
    energy, force, stalled = problem.energy(x), problem.force(x), 0
    while True:
        residual = float(np.linalg.norm(force)) / scale
        solution.history.append(residual)
        solution.seconds.append(perf_counter() - start)
        if residual <= tolerance:
            return solution
        iterations = len(solution.history) - first - 1
        if not np.isfinite(residual) or iterations >= max_iterations or stalled > STALL:
            raise NotConverged(_complaint(solution, iterations, tolerance), solution.history)
        step = _step(problem, solution, energy, force, _forcing(solution.history[first:], tolerance))
        if step is None:
            raise NotConverged(_complaint(solution, iterations, tolerance), solution.history)
        solution.x, energy, length = step
        stalled = stalled + 1 if length < CUT else 0
        force = problem.force(solution.x)


def _step(problem, solution, energy, force, forcing) -> tuple[np.ndarray, float, float] | None:
    """Where a step leads, the energy there, and how long it is in parts of what it might be; None if none leads down.

    The exact Hessian's, or else the clamped one's. Where surfaces meet, with kinks as sharp as friction's, the lower
    of both is taken if the exact one's has to be cut.
    """
    limit, best = getattr(problem, "limit", None), None
    for definite in (False, True):
        direction, positive = _direction(problem, solution, force, forcing, definite)
        if not positive:
            continue
        longest = limit(solution.x, direction) if limit else np.inf
        found = _line_search(problem, solution.x, energy, force, direction, definite, longest)
        if found is None:
            continue
        length = found[2] / min(1.0, longest)
        if best is None or found[1] < best[1]:
            best = found[0], found[1], length
        if not limit or length > 0.5:
            break
    return best


def _direction(problem, solution, force, forcing, definite):
    multiply, precondition = problem.linearise(solution.x, definite)
    direction, products, positive = conjugate_gradients(multiply, precondition, force, forcing, 500)
    solution.linear_solves += 1
    solution.products += products
    # the clamped Hessian may still be singular; what was found before that shows is a descent direction
    return direction, positive or (definite and bool(direction.any()))


def _forcing(history: list[float], tolerance: float) -> float:
    if len(history) == 1:
        return 0.1
    return min(0.1, max(0.5 * (history[-1] / history[-2]) ** 2, 0.3 * tolerance / history[-1]))


def _line_search(problem, x, energy, force, direction, grow, longest) -> tuple[np.ndarray, float, float] | None:
    """The first step 1, ½, ¼ … that lowers the energy enough, or with ``grow`` the longest of 1, 2, 4 … that
    lowers it further: a clamped Hessian makes short steps out of the neighbourhood of a saddle. ``longest`` is the
    step to begin with where it is less than 1, and none is longer."""
    slope = np.vdot(force, direction)
    # what rounding may do to a sum of as many terms as there are elements must not reject the last steps
    noise = 1e-12 * (abs(energy) + slope)
    step, best = min(1.0, longest), None
    while 1e-9 * min(1.0, longest) < step < min(1e9, longest * (1.0 + 1e-12)):
        candidate = x + step * direction
        reached = problem.energy(candidate)
        falls = reached <= energy - 1e-4 * step * slope + noise
        if best is None:
            if not falls:
                step *= 0.5
                continue
            best = candidate, reached, step
            if not grow or step < 1.0:
                break
        elif falls and reached < best[1]:
            best = candidate, reached, step
        else:
            break
        step *= 2.0
    return best


def _complaint(solution: Solution, iterations: int, tolerance: float) -> str:
    return (
        f"Newton's method stopped after {iterations} iterations at a relative residual of "
        f"{solution.history[-1]:.1e}, above the tolerance {tolerance:.0e}"
    )
