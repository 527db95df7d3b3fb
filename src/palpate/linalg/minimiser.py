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
"""Factor by which the residual has to fall in so many iterations of L-BFGS, or Newton's method is faster."""
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
    """Positions that L-BFGS has reached, and its history.

    x : (n, 3) [m], the last positions
    forces : ‖force‖ [N] before each iteration and at the end; seconds : when each was known [s], from the start
    convex : whether the force's change along each step opposed the step, as it does where the energy is convex
    """

    x: np.ndarray
    forces: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    convex: bool = True

    def solution(self, scale: float) -> "Solution":
        """Return the solution with residuals relative to ``scale`` [N]; an iteration counts as one product."""
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
        """Add history and cost of the attempt ``before``, at whose end this solution started; return this solution."""
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
    """Find positions with ‖force‖ ≤ ``tolerance`` · ``scale`` [N], by L-BFGS from ``x`` or else by a second method.

    solve : applies the inverse of the constant Hessian that L-BFGS starts from
    otherwise : the second method, Newton's as a rule: from positions to a solution; its errors are raised
    patient : whether L-BFGS goes on where it is slow, or where the energy is not convex
    """

    def goes_on(descent: Descent) -> bool:
        fast = len(descent.forces) <= WINDOW or descent.forces[-1] <= PACE * descent.forces[-1 - WINDOW]
        return patient or (descent.convex and fast)

    descent = minimise_by_lbfgs(problem, solve, x, tolerance * scale, MAX_ITERATIONS, goes_on)
    if descent.forces[-1] <= tolerance * scale and descent.convex:
        return descent.solution(scale)
    return otherwise(descent.x if descent.convex else x).after(descent.solution(scale))


def minimise_by_lbfgs(
    problem: Smooth,
    solve: Product,
    x: np.ndarray,
    tolerance_n: float,
    iterations: int,
    callback: Callable[[Descent], bool] = lambda descent: True,
    kept: int = MEMORY,
) -> Descent:
    """Minimise an energy from ``x`` (n, 3) [m] by L-BFGS: ``iterations``, or fewer once ‖force‖ ≤ ``tolerance_n`` [N].

    solve : applies the inverse of the constant Hessian that it starts from
    callback : called before each iteration, and returns whether to continue
    kept : number of latest steps that improve the inverse Hessian
    After Liu, Bouaziz and Kavan (2017), but with the true Hessian at rest, so that one iteration answers small loads.
    No step raises the energy beyond rounding. Where none lowers it, all earlier steps are forgotten; where that does
    not help, the search ends.
    """
    descent, began = Descent(x), perf_counter()
    energy, force = problem.energy(x), problem.force(x)
    memory: Memory = deque(maxlen=kept)
    while True:
        descent.forces.append(float(np.linalg.norm(force)))
        descent.seconds.append(perf_counter() - began)
        if descent.forces[-1] <= tolerance_n or len(descent.forces) > iterations or not callback(descent):
            return descent
        direction = _lbfgs_direction(solve, force, memory)
        lower_point = line_search(problem, descent.x, energy, force, direction, shortest=1e-6)
        if lower_point is None and memory:
            memory.clear()
            direction = solve(force)
            lower_point = line_search(problem, descent.x, energy, force, direction, shortest=1e-6)
        if lower_point is None:
            return descent
        descent.x, energy, length = lower_point
        old_force, force = force, problem.force(descent.x)
        step, force_change = length * direction, old_force - force
        if (curvature := float(np.vdot(step, force_change))) > 0.0:
            memory.append((step, force_change, 1.0 / curvature))
        else:
            descent.convex = False


def _lbfgs_direction(solve: Product, force: np.ndarray, memory: Memory) -> np.ndarray:
    """Return the inverse Hessian times ``force`` by the two-loop recursion (Nocedal 1980) over the steps in ``memory``.

    The function daxpy adds multiples in place, without an array in between.
    """
    direction, factors = force.copy(), []
    for step, force_change, inverse_product in reversed(memory):
        factors.append(inverse_product * float(np.vdot(step, direction)))
        daxpy(force_change.ravel(), direction.ravel(), a=-factors[-1])
    direction = solve(direction)
    for (step, force_change, inverse_product), factor in zip(memory, reversed(factors), strict=True):
        daxpy(step.ravel(), direction.ravel(), a=factor - inverse_product * float(np.vdot(force_change, direction)))
    return direction


def minimise_by_newton(
    problem: Problem,
    x: np.ndarray,
    scale: float,
    tolerance: float,
    max_iterations: int = 60,
    solution: Solution | None = None,
    rounding_n: float = 0.0,
) -> Solution:
    """Find positions with ‖force‖ ≤ ``tolerance`` · ``scale`` [N] by Newton's method, starting from ``x``.

    The exact Hessian is tried first; if conjugate gradients find negative curvature, its clamped form gives a descent
    direction instead. Steps are halved until the energy decreases enough (Armijo). The tolerance of the linear solves
    follows the progress (Eisenstat and Walker 1996, choice 2). If the problem has a ``limit``, no step exceeds it.

    solution : of an earlier attempt that is continued; history and cost are added to it, even if this one fails
    rounding_n : forces [N] that come from rounding the positions; a search that can go no further below them has
        reached what floating point allows, as for a nearly incompressible body, and its end is accepted

    Raises NotConverged, with the history of relative residuals, after ``max_iterations``, if the energy does not
    decrease any more, or if a value is not finite.
    """
    solution = solution or Solution(x)
    solution.x, earlier_count = x, len(solution.history)
    start = perf_counter() - (solution.seconds[-1] if earlier_count else 0.0)
    energy, stalled = problem.energy(x), 0
    # where the energy is infinite, the force need not exist
    force = problem.force(x) if np.isfinite(energy) else np.full_like(x, np.inf)
    while True:
        residual = float(np.linalg.norm(force)) / scale
        solution.history.append(residual)
        solution.seconds.append(perf_counter() - start)
        if residual <= tolerance:
            return solution
        iterations = len(solution.history) - earlier_count - 1
        continues = np.isfinite(residual) and iterations < max_iterations and stalled <= MAX_SHORT
        linear_tolerance = _linear_tolerance(solution.history[earlier_count:], tolerance)
        step = _newton_step(problem, solution, energy, force, linear_tolerance) if continues else None
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
    """Return where Newton's method gets from ``x`` in at most ``iterations``; NotConverged if an iteration fails."""
    solution = Solution(x)
    try:
        minimise_by_newton(problem, x, scale, tolerance, iterations, solution)
    except NotConverged:
        if solution.iterations < iterations or not np.isfinite(solution.history[-1]):
            raise
    return solution


def _linear_tolerance(history: list[float], tolerance: float) -> float:
    """Return the tolerance of the next linear solve, after Eisenstat and Walker 1996, by the residuals so far."""
    if len(history) == 1:
        return 0.1
    return min(0.1, max(0.5 * (history[-1] / history[-2]) ** 2, 0.3 * tolerance / history[-1]))


def _newton_step(
    problem: Problem, solution: Solution, energy: float, force: np.ndarray, accuracy: float
) -> Candidate | None:
    """Return the end of a Newton step and its length relative to the longest one allowed; None if no step descends.

    accuracy : relative residual of the linear solve
    The direction is that of the exact Hessian or, if it fails, of the clamped one. In contact, where friction makes
    the energy nearly non-smooth, both are tried if the first has to be shortened, and the lower energy is taken.
    """
    limit: Callable[[np.ndarray, np.ndarray], float] | None = getattr(problem, "limit", None)
    best: Candidate | None = None
    for definite in (False, True):
        multiply, precondition = problem.linearise(solution.x, definite)
        direction, products, positive = conjugate_gradients(multiply, precondition, force, accuracy, 500)
        solution.linear_solves += 1
        solution.products += products
        # the clamped Hessian may be singular; the direction found before that shows is still one of descent
        if not positive and not (definite and direction.any()):
            continue
        longest_step = limit(solution.x, direction) if limit else np.inf
        lower_point = line_search(problem, solution.x, energy, force, direction, SHORTEST, definite, longest_step)
        if lower_point is None:
            continue
        length = lower_point[2] / min(1.0, longest_step)
        if best is None or lower_point[1] < best[1]:
            best = lower_point[0], lower_point[1], length
        if not limit or length > 0.5:
            break
    return best


def line_search(
    problem: Smooth,
    x: np.ndarray,
    energy: float,
    force: np.ndarray,
    direction: np.ndarray,
    shortest: float,
    grow: bool = False,
    longest: float = np.inf,
) -> Candidate | None:
    """Return the end of the first step of length 1, ½, ¼ … along ``direction`` that decreases the energy enough.

    Enough is what Armijo's rule asks for; None if no such step is longer than ``shortest`` times the first one tried.
    grow : whether lengths of 2, 4 … are tried next while the energy decreases further, as a clamped Hessian makes short
        steps near a saddle
    longest : bound of all lengths, and the first one tried if it is below 1
    """
    slope = float(np.vdot(force, direction))
    if not 0.0 < slope < np.inf:
        return None
    noise = 1e-12 * (abs(energy) + slope)  # rounding, of a sum over all elements, must not reject the last steps
    step = min(1.0, longest)
    best: Candidate | None = None
    while shortest * min(1.0, longest) < step < min(1e9, longest * (1.0 + 1e-12)):
        candidate = x + step * direction
        new_energy = problem.energy(candidate)
        decreases = new_energy <= energy - 1e-4 * step * slope + noise
        if best is None:
            if not decreases:
                step *= 0.5
                continue
            best = candidate, new_energy, step
            if not grow or step < 1.0:
                break
        elif decreases and new_energy < best[1]:
            best = candidate, new_energy, step
        else:
            break
        step *= 2.0
    return best
