"""Find a minimum with a factor that never changes: L-BFGS that starts from the stiffness at rest."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

import numpy as np
from scipy.linalg.blas import daxpy

MEMORY = 8
"""Steps that the inverse Hessian is improved by (Liu, Bouaziz and Kavan 2017 keep 5)."""

Memory = deque[tuple[np.ndarray, np.ndarray, float]]
"""Steps (n, 3) [m], how they changed the force (n, 3) [N], and the inverse of their product [1/J]."""


class Smooth(Protocol):
    """An energy to minimise; positions are (n, 3) [m]."""

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J]."""

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return minus the energy's gradient (n, 3) [N], zero at held nodes."""


@dataclass
class Descent:
    """The way that a search has gone.

    x : (n, 3) [m], where it ended
    forces : ‖force‖ [N] before each iteration and at the end; seconds : when each was known [s]
    convex : whether each step has bent the force back, as it does where the energy is convex
    """

    x: np.ndarray
    forces: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    convex: bool = True


def minimise_by_lbfgs(
    problem: Smooth,
    solve: Callable[[np.ndarray], np.ndarray],
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
        found = _search(problem, way.x, energy, force, _direction(solve, force, memory))
        if found is None and memory:
            memory.clear()
            found = _search(problem, way.x, energy, force, solve(force))
        if found is None:
            return way
        step, energy = found
        way.x = way.x + step
        before, force = force, problem.force(way.x)
        bend = before - force
        if (product := float(np.vdot(step, bend))) > 0.0:
            memory.append((step, bend, 1.0 / product))
        else:
            way.convex = False


def _direction(solve: Callable[[np.ndarray], np.ndarray], force: np.ndarray, memory: Memory) -> np.ndarray:
    """Compute the direction by the two loops of L-BFGS."""
    ahead, parts = force.copy(), []
    for step, bend, inverse in reversed(memory):
        parts.append(inverse * float(np.vdot(step, ahead)))
        _add(-parts[-1], bend, ahead)
    ahead = solve(ahead)
    for (step, bend, inverse), part in zip(memory, reversed(parts), strict=True):
        _add(part - inverse * float(np.vdot(bend, ahead)), step, ahead)
    return ahead


def _add(factor: float, part: np.ndarray, total: np.ndarray) -> None:
    """Add ``factor`` ``part`` to ``total`` in place, both (n, 3) and contiguous, without an array in between."""
    daxpy(part.ravel(), total.ravel(), a=factor)


def _search(
    problem: Smooth, x: np.ndarray, energy: float, force: np.ndarray, ahead: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Find the first of the steps 1, ½, ¼ … that lowers the energy sufficiently (Armijo), and the energy there."""
    slope = float(np.vdot(force, ahead))
    if not 0.0 < slope < np.inf:
        return None
    noise = 1e-12 * (abs(energy) + slope)  # rounding, of a sum over all elements, must not reject the last steps
    length = 1.0
    while length > 1e-6:
        reached = problem.energy(x + length * ahead)
        if reached <= energy - 1e-4 * length * slope + noise:
            return length * ahead, reached
        length *= 0.5
    return None
