"""Newton's method for the minimum of a potential energy, with a line search and inexact linear solves."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.multigrid import conjugate_gradients
from palpate.solvers.lbfgs import Smooth

Product = Callable[[np.ndarray], np.ndarray]
"""A linear map of (n_nodes, 3) arrays."""

SHORT, MAX_SHORT = 0.02, 3
"""A line search that ends below this length is short; after more short ones in succession the energy is not smooth."""

Candidate = tuple[np.ndarray, float, float]
"""Positions (n_nodes, 3) [m], their energy [J], and a step length."""


class Problem(Smooth, Protocol):
    """An energy to minimise, with its Hessian.

    One whose steps are limited, so that no body passes through another, has ``limit(x, direction)``, too: the fraction
    of ``direction`` that a step from ``x`` may have, infinite if nothing is in the way.
    """

    def linearise(self, x: np.ndarray, definite: bool) -> tuple[Product, Product]:
        """Return the products with the Hessian, clamped if ``definite``, and with a preconditioner for it."""


@dataclass
class Solution:
    """The result of Newton's method and its cost.

    x : (n_nodes, 3) [m]
    history : relative residual before each iteration and at the end; seconds : time at which each was known [s]
    """

    x: np.ndarray
    history: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    linear_solves: int = 0
    products: int = 0

    @property
    def iterations(self) -> int:
        """The number of Newton iterations."""
        return len(self.history) - 1


def minimise_by_newton(
    problem: Problem,
    x: np.ndarray,
    scale: float,
    tolerance: float,
    max_iterations: int = 60,
    solution: Solution | None = None,
) -> Solution:
    """Find x with ‖force(x)‖ ≤ ``tolerance`` · ``scale`` [N], starting from ``x``.

    The exact Hessian is tried first; if conjugate gradients find negative curvature, its clamped form gives a descent
    direction instead. Steps are halved until the energy decreases enough (Armijo). The tolerance of the linear solves
    follows the progress (Eisenstat and Walker 1996, choice 2). If the problem has a ``limit``, no step exceeds it.

    solution : the result of an earlier attempt to continue; the cost of this one is added to it, even if it fails

    Raises NotConverged, with the history of relative residuals, after ``max_iterations``, if the energy does not
    decrease any more, or if a value is not finite.
    """
    solution = solution or Solution(x)
    solution.x, first = x, len(solution.history)
    start = perf_counter() - (solution.seconds[-1] if first else 0.0)
    energy, stalled = problem.energy(x), 0
    if not np.isfinite(energy):
        solution.history.append(np.inf)
        solution.seconds.append(perf_counter() - start)
        raise _not_found(solution, 0, tolerance)
    force = problem.force(x)
    while True:
        residual = float(np.linalg.norm(force)) / scale
        solution.history.append(residual)
        solution.seconds.append(perf_counter() - start)
        if residual <= tolerance:
            return solution
        iterations = len(solution.history) - first - 1
        if not np.isfinite(residual) or iterations >= max_iterations or stalled > MAX_SHORT:
            raise _not_found(solution, iterations, tolerance)
        step = _step(problem, solution, energy, force, _forcing(solution.history[first:], tolerance))
        if step is None:
            raise _not_found(solution, iterations, tolerance)
        solution.x, energy, length = step
        stalled = stalled + 1 if length < SHORT else 0
        force = problem.force(solution.x)


def capped(problem: Problem, x: np.ndarray, scale: float, tolerance: float, iterations: int) -> Solution:
    """Do so many iterations at most from ``x``; NotConverged if one fails, but not because there are too few."""
    solution = Solution(x)
    try:
        minimise_by_newton(problem, x, scale, tolerance, iterations, solution)
    except NotConverged:
        if solution.iterations < iterations or not np.isfinite(solution.history[-1]):
            raise
    return solution


def _step(problem: Problem, solution: Solution, energy: float, force: np.ndarray, forcing: float) -> Candidate | None:
    """Return the end of a step and its length relative to the longest one allowed; None if no step descends.

    The direction is that of the exact Hessian or, if it fails, of the clamped one. In contact, where friction makes
    the energy nearly non-smooth, both are tried if the first has to be shortened, and the lower energy is taken.
    """
    limit: Callable[[np.ndarray, np.ndarray], float] | None = getattr(problem, "limit", None)
    best: Candidate | None = None
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


def _direction(
    problem: Problem, solution: Solution, force: np.ndarray, forcing: float, definite: bool
) -> tuple[np.ndarray, bool]:
    """Return a direction and whether it is one of descent."""
    multiply, precondition = problem.linearise(solution.x, definite)
    direction, products, positive = conjugate_gradients(multiply, precondition, force, forcing, 500)
    solution.linear_solves += 1
    solution.products += products
    # the clamped Hessian may be singular; the direction found before that shows is still one of descent
    return direction, positive or (definite and bool(direction.any()))


def _forcing(history: list[float], tolerance: float) -> float:
    if len(history) == 1:
        return 0.1
    return min(0.1, max(0.5 * (history[-1] / history[-2]) ** 2, 0.3 * tolerance / history[-1]))


def _line_search(
    problem: Problem, x: np.ndarray, energy: float, force: np.ndarray, direction: np.ndarray, grow: bool, longest: float
) -> Candidate | None:
    """Find the first of the lengths 1, ½, ¼ … that decreases the energy enough; None if there is none.

    ``grow`` then tries 2, 4 … while the energy decreases further, as a clamped Hessian makes short steps near a
    saddle. No length exceeds ``longest``, which is the first one tried if it is less than 1.
    """
    slope = np.vdot(force, direction)
    # rounding errors of the energy, a sum over all elements, must not reject the last steps
    noise = 1e-12 * (abs(energy) + slope)
    step = min(1.0, longest)
    best: Candidate | None = None
    while 1e-9 * min(1.0, longest) < step < min(1e9, longest * (1.0 + 1e-12)):
        candidate = x + step * direction
        reached = problem.energy(candidate)
        decreases = reached <= energy - 1e-4 * step * slope + noise
        if best is None:
            if not decreases:
                step *= 0.5
                continue
            best = candidate, reached, step
            if not grow or step < 1.0:
                break
        elif decreases and reached < best[1]:
            best = candidate, reached, step
        else:
            break
        step *= 2.0
    return best


def _not_found(solution: Solution, iterations: int, tolerance: float) -> NotConverged:
    message = (
        f"Newton's method stopped after {iterations} iterations at a relative residual of "
        f"{solution.history[-1]:.1e}, above the tolerance {tolerance:.0e}"
    )
    return NotConverged(message, solution.history)
