"""Find a minimum with a factor that never changes: L-BFGS that starts from the stiffness at rest."""

from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

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


def descend(
    problem: Smooth, solve: Callable[[np.ndarray], np.ndarray], x: np.ndarray, enough: float, iterations: int
) -> np.ndarray:
    """Return positions after so many iterations from ``x`` (n, 3) [m], or fewer once ‖force‖ ≤ ``enough`` [N].

    solve : applies the inverse of the constant Hessian it starts from
    After Liu, Bouaziz and Kavan (2017), but with the true Hessian at rest, so that one iteration answers small loads.
    No step raises the energy; where none lowers it the memory is forgotten, and if that does not help it is the end.
    """
    energy, force = problem.energy(x), problem.force(x)
    memory: Memory = deque(maxlen=MEMORY)
    for _ in range(iterations):
        if np.linalg.norm(force) <= enough:
            break
        found = _search(problem, x, energy, force, _direction(solve, force, memory))
        if found is None and memory:
            memory.clear()
            found = _search(problem, x, energy, force, solve(force))
        if found is None:
            break
        step, energy = found
        x = x + step
        before, force = force, problem.force(x)
        bend = before - force
        if (product := float(np.vdot(step, bend))) > 0.0:  # elsewhere the energy is not convex
            memory.append((step, bend, 1.0 / product))
    return x


def _direction(solve: Callable[[np.ndarray], np.ndarray], force: np.ndarray, memory: Memory) -> np.ndarray:
    """Compute the direction by the two loops of L-BFGS."""
    ahead, parts = force.copy(), []
    for step, bend, inverse in reversed(memory):
        parts.append(inverse * float(np.vdot(step, ahead)))
        ahead -= parts[-1] * bend
    ahead = solve(ahead)
    for (step, bend, inverse), part in zip(memory, reversed(parts), strict=True):
        ahead += (part - inverse * float(np.vdot(bend, ahead))) * step
    return ahead


def _search(
    problem: Smooth, x: np.ndarray, energy: float, force: np.ndarray, ahead: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Find the first of the steps 1, ½, ¼ … that lowers the energy enough (Armijo), and the energy there."""
    slope = float(np.vdot(force, ahead))
    if not 0.0 < slope < np.inf:
        return None
    length = 1.0
    while length > 1e-6:
        reached = problem.energy(x + length * ahead)
        if reached <= energy - 1e-4 * length * slope:
            return length * ahead, reached
        length *= 0.5
    return None
