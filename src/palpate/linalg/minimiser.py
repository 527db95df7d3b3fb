"""Find a minimum of a potential energy: L-BFGS, Newton's method, the line search of both, and which is taken when.

L-BFGS starts from a Hessian that never changes, as that at rest, so that an iteration is one pass over the elements and
one solution. An iteration of Newton's method assembles a Hessian and needs many solutions. It is the fallback: from
where L-BFGS has come to if that is slow, and from the start if L-BFGS has met a place where the energy is not convex,
at which the two may go different ways.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

import numpy as np
from scipy.linalg.blas import daxpy

from palpate.errors import NotConverged
from palpate.linalg.multigrid import conjugate_gradients

Product = Callable[[np.ndarray], np.ndarray]
"""A linear map of (n_nodes, 3) arrays."""

MAX_ITERATIONS = 60
"""Iterations of L-BFGS after which Newton's method takes over; 10 to 30 do where nothing is wrong."""
PACE, WINDOW = 0.1, 12
"""In so many iterations the residual has to fall to this share of what it was, or Newton's method is faster."""
MEMORY = 8
"""Steps that the inverse Hessian is improved by (Liu, Bouaziz and Kavan 2017 keep 5)."""
SHORT, MAX_SHORT = 0.02, 3
"""A line search that ends below this length is short; after more short ones in succession the energy is not smooth."""
SHORTEST = 1e-9
"""Length at which a line search of Newton's method gives up, and 1e-6 that of L-BFGS, which then forgets its memory."""

Memory = deque[tuple[np.ndarray, np.ndarray, float]]
"""Steps (n, 3) [m], how they changed the force (n, 3) [N], and the inverse of their product [1/J]."""
Candidate = tuple[np.ndarray, float, float]
"""Positions (n_nodes, 3) [m], their energy [J], and a step length."""


class Smooth(Protocol):
    """An energy to minimise; positions are (n, 3) [m]."""

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J]."""

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return minus the energy's gradient (n, 3) [N], zero at held nodes."""


class Problem(Smooth, Protocol):
    """An energy to minimise, with its Hessian.

    One whose steps are limited, so that no body passes through another, has ``limit(x, direction)``, too: the fraction
    of ``direction`` that a step from ``x`` may have, infinite if nothing is in the way.
    """

    def linearise(self, x: np.ndarray, definite: bool) -> tuple[Product, Product]:
        """Return the products with the Hessian, clamped if ``definite``, and with a preconditioner for it."""


@dataclass
class Descent:
    """The way that L-BFGS has gone.

    x : (n, 3) [m], where it ended
    forces : ‖force‖ [N] before each iteration and at the end; seconds : when each was known [s]
    convex : whether each step has bent the force back, as it does where the energy is convex
    """

    x: np.ndarray
    forces: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    convex: bool = True

    def over(self, scale: float) -> "Solution":
        """Return the same with forces relative to ``scale`` [N]; an iteration counts as one product."""
        return Solution(self.x, [force / scale for force in self.forces], self.seconds, products=len(self.forces) - 1)


@dataclass
class Solution:
    """A minimum and its cost.

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
        """The number of iterations."""
        return len(self.history) - 1

    def after(self, before: "Solution") -> "Solution":
        """Add what was spent on the solution ``before``, whose last residual this one begins with; return this one."""
        self.history = before.history[:-1] + self.history
        self.seconds = before.seconds[:-1] + [before.seconds[-1] + each for each in self.seconds]
        self.linear_solves += before.linear_solves
        self.products += before.products
        return self


def descend_or(
    problem: Smooth,
    solve: Product,
    x: np.ndarray,
    scale: float,
    tolerance: float,
    otherwise: Callable[[np.ndarray], Solution],
    patient: bool = False,
) -> Solution:
    """Find x with ‖force(x)‖ ≤ ``tolerance`` · ``scale`` [N] by L-BFGS, or by what is done ``otherwise``.

    solve : as ``minimise_by_lbfgs`` has it
    otherwise : Newton's method as a rule, from the positions to start at to a solution; its errors are raised
    patient : whether to go on where L-BFGS is slow, or the energy is not convex
    """

    def worth(way: Descent) -> bool:
        pace = len(way.forces) <= WINDOW or way.forces[-1] <= PACE * way.forces[-1 - WINDOW]
        return patient or (way.convex and pace)

    way = minimise_by_lbfgs(problem, solve, x, tolerance * scale, MAX_ITERATIONS, worth)
    if way.forces[-1] <= tolerance * scale and way.convex:
        return way.over(scale)
    return otherwise(way.x if way.convex else x).after(way.over(scale))


def minimise_by_lbfgs(
    problem: Smooth,
    solve: Product,
    x: np.ndarray,
    tolerance_n: float,
    iterations: int,
    callback: Callable[[Descent], bool] = lambda way: True,
    kept: int = MEMORY,
) -> Descent:
    """Do so many iterations from ``x`` (n, 3) [m], or fewer once ‖force‖ ≤ ``tolerance_n`` [N].

    solve : applies the inverse of the constant Hessian it starts from
    callback : is asked before each iteration whether to continue
    kept : how many steps the inverse Hessian is improved by
    After Liu, Bouaziz and Kavan (2017), but with the true Hessian at rest, so that one iteration answers small loads.
    No step raises the energy beyond rounding; where none lowers it the memory is forgotten, and if that does not help
    it is the end.
    """
    way, began = Descent(x), perf_counter()
    energy, force = problem.energy(x), problem.force(x)
    memory: Memory = deque(maxlen=kept)
    while True:
        way.forces.append(float(np.linalg.norm(force)))
        way.seconds.append(perf_counter() - began)
        if way.forces[-1] <= tolerance_n or len(way.forces) > iterations or not callback(way):
            return way
        ahead = _two_loops(solve, force, memory)
        found = line_search(problem, way.x, energy, force, ahead, shortest=1e-6)
        if found is None and memory:
            memory.clear()
            ahead = solve(force)
            found = line_search(problem, way.x, energy, force, ahead, shortest=1e-6)
        if found is None:
            return way
        way.x, energy, length = found
        before, force = force, problem.force(way.x)
        step, bend = length * ahead, before - force
        if (product := float(np.vdot(step, bend))) > 0.0:
            memory.append((step, bend, 1.0 / product))
        else:
            way.convex = False


def _two_loops(solve: Product, force: np.ndarray, memory: Memory) -> np.ndarray:
    """Compute the direction of L-BFGS; daxpy adds multiples in place, without an array in between."""
    ahead, parts = force.copy(), []
    for step, bend, inverse in reversed(memory):
        parts.append(inverse * float(np.vdot(step, ahead)))
        daxpy(bend.ravel(), ahead.ravel(), a=-parts[-1])
    ahead = solve(ahead)
    for (step, bend, inverse), part in zip(memory, reversed(parts), strict=True):
        daxpy(step.ravel(), ahead.ravel(), a=part - inverse * float(np.vdot(bend, ahead)))
    return ahead


def minimise_by_newton(
    problem: Problem,
    x: np.ndarray,
    scale: float,
    tolerance: float,
    max_iterations: int = 60,
    solution: Solution | None = None,
    rounding_n: float = 0.0,
) -> Solution:
    """Find x with ‖force(x)‖ ≤ ``tolerance`` · ``scale`` [N], starting from ``x``.

    The exact Hessian is tried first; if conjugate gradients find negative curvature, its clamped form gives a descent
    direction instead. Steps are halved until the energy decreases enough (Armijo). The tolerance of the linear solves
    follows the progress (Eisenstat and Walker 1996, choice 2). If the problem has a ``limit``, no step exceeds it.

    solution : the result of an earlier attempt to continue; the cost of this one is added to it, even if it fails
    rounding_n : forces [N] that rounding the positions makes; where the search ends below, as under a small load or of
        a nearly incompressible body, that is the best that floating point allows, and is accepted

    Raises NotConverged, with the history of relative residuals, after ``max_iterations``, if the energy does not
    decrease any more, or if a value is not finite.
    """
    solution = solution or Solution(x)
    solution.x, first = x, len(solution.history)
    start = perf_counter() - (solution.seconds[-1] if first else 0.0)
    energy, stalled = problem.energy(x), 0
    # where the energy is infinite, the force need not exist
    force = problem.force(x) if np.isfinite(energy) else np.full_like(x, np.inf)
    while True:
        residual = float(np.linalg.norm(force)) / scale
        solution.history.append(residual)
        solution.seconds.append(perf_counter() - start)
        if residual <= tolerance:
            return solution
        iterations = len(solution.history) - first - 1
        able = np.isfinite(residual) and iterations < max_iterations and stalled <= MAX_SHORT
        forcing = _forcing(solution.history[first:], tolerance)
        step = _newton_step(problem, solution, energy, force, forcing) if able else None
        if step is None and residual * scale <= rounding_n:
            return solution
        if step is None:
            raise NotConverged(
                f"Newton's method stopped after {iterations} iterations at a relative residual of {residual:.1e}, "
                f"above the tolerance {tolerance:.0e}",
                solution.history,
            )
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


def _forcing(history: list[float], tolerance: float) -> float:
    if len(history) == 1:
        return 0.1
    return min(0.1, max(0.5 * (history[-1] / history[-2]) ** 2, 0.3 * tolerance / history[-1]))


def _newton_step(
    problem: Problem, solution: Solution, energy: float, force: np.ndarray, forcing: float
) -> Candidate | None:
    """Return the end of a step and its length relative to the longest one allowed; None if no step descends.

    The direction is that of the exact Hessian or, if it fails, of the clamped one. In contact, where friction makes
    the energy nearly non-smooth, both are tried if the first has to be shortened, and the lower energy is taken.
    """
    limit: Callable[[np.ndarray, np.ndarray], float] | None = getattr(problem, "limit", None)
    best: Candidate | None = None
    for definite in (False, True):
        multiply, precondition = problem.linearise(solution.x, definite)
        direction, products, positive = conjugate_gradients(multiply, precondition, force, forcing, 500)
        solution.linear_solves += 1
        solution.products += products
        # the clamped Hessian may be singular; the direction found before that shows is still one of descent
        if not positive and not (definite and direction.any()):
            continue
        longest = limit(solution.x, direction) if limit else np.inf
        found = line_search(problem, solution.x, energy, force, direction, SHORTEST, definite, longest)
        if found is None:
            continue
        length = found[2] / min(1.0, longest)
        if best is None or found[1] < best[1]:
            best = found[0], found[1], length
        if not limit or length > 0.5:
            break
    return best


def line_search(
    problem: Smooth,
    x: np.ndarray,
    energy: float,
    force: np.ndarray,
    direction: np.ndarray,
    shortest: float = SHORTEST,
    grow: bool = False,
    longest: float = np.inf,
) -> Candidate | None:
    """Find the first of the lengths 1, ½, ¼ … that decreases the energy enough (Armijo); None if there is none.

    ``grow`` then tries 2, 4 … while the energy decreases further, as a clamped Hessian makes short steps near a
    saddle. No length exceeds ``longest``, which is the first one tried if it is less than 1, or is below ``shortest``
    times the first one.
    """
    slope = float(np.vdot(force, direction))
    if not 0.0 < slope < np.inf:
        return None
    noise = 1e-12 * (abs(energy) + slope)  # rounding, of a sum over all elements, must not reject the last steps
    step = min(1.0, longest)
    best: Candidate | None = None
    while shortest * min(1.0, longest) < step < min(1e9, longest * (1.0 + 1e-12)):
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
