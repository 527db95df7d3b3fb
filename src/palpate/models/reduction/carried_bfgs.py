"""Find one minimum after another of functions that change little: BFGS that keeps its inverse Hessian."""

from collections.abc import Callable

import numpy as np

Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""A function of coordinates (r,) and its gradient (r,)."""
SHORTEST = 1e-6
"""A step that is cut below this part of its length is none."""
NOISE = 1e-14
"""Relative rounding of the function, beside what the caller knows of it."""


class CarriedBfgs:
    """BFGS with a full inverse Hessian (r, r), carried from each minimum to the next (Nocedal and Wright 2006, 6.1).

    first : (r,), the inverse of a diagonal Hessian; the search begins with it, and again where the carried one fails
    """

    def __init__(self, first: np.ndarray):
        self._first = np.diag(first)
        self._inverse = self._first.copy()

    def minimise(
        self, evaluate: Evaluate, q: np.ndarray, enough: float, noise: float, iterations: int
    ) -> tuple[np.ndarray, float]:
        """Return coordinates (r,) from ``q`` on, and the norm of the gradient there.

        The norm is at most ``enough``, or 0 where what is left to gain is below the function's rounding, ``noise``; it
        is more where ``iterations`` did not suffice or no step descends.
        """
        value, gradient = evaluate(q)
        for _ in range(iterations):
            norm = float(np.linalg.norm(gradient))
            if norm <= enough:
                return q, norm
            found = self._search(evaluate, q, value, gradient, noise)
            if found is None:
                if float(gradient @ self._first @ gradient) <= noise + NOISE * abs(value):
                    return q, 0.0
                if np.array_equal(self._inverse, self._first):
                    break
                self._inverse = self._first.copy()
                continue
            step, value, ahead = found
            self._learn(step, ahead - gradient)
            q, gradient = q + step, ahead
        return q, float(np.linalg.norm(gradient))

    def _search(
        self, evaluate: Evaluate, q: np.ndarray, value: float, gradient: np.ndarray, noise: float
    ) -> tuple[np.ndarray, float, np.ndarray] | None:
        """Find the first of the steps 1, ½, ¼ … that descends enough (Armijo), the value there, and the gradient."""
        ahead = -(self._inverse @ gradient)
        slope, length = float(gradient @ ahead), 1.0
        if not slope < 0.0:
            return None
        while length > SHORTEST:
            reached, there = evaluate(q + length * ahead)
            if reached <= value + 1e-4 * length * slope + noise + NOISE * abs(value):
                return length * ahead, reached, there
            length *= 0.5
        return None

    def _learn(self, step: np.ndarray, bend: np.ndarray) -> None:
        """Update the inverse Hessian by how a step bent the gradient; not where the function is not convex."""
        product = float(step @ bend)
        if product <= 1e-12 * float(np.linalg.norm(step) * np.linalg.norm(bend)):
            return
        turned = self._inverse @ bend
        mixed = np.outer(step, turned)
        scale = (1.0 + float(bend @ turned) / product) / product
        self._inverse += scale * np.outer(step, step) - (mixed + mixed.T) / product
