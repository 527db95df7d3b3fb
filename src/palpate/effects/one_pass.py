"""Energy and force of elastic elements from one pass over them, kept for the last positions asked for."""

import numpy as np

from palpate.errors import NotConverged

KEPT = 2
"""Positions that are kept: a line search goes one step too far, a step in time begins at one of two places."""


class OnePass:
    """The energy and force at the last positions; who asks for both at the same ones pays for one pass.

    Newton's method asks for the energy at the end of each step, and then for the force there. Kept positions are
    copies and are compared by value, since integrators may change ``x`` in place.
    """

    forbids = False
    """Whether the energy of a flat or inverted element is infinite."""

    def __init__(self) -> None:
        self._kept: list[tuple[np.ndarray, float, np.ndarray]] = []

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n_nodes, 3) [m] to ``force`` (n_nodes, 3), and return the energy [J]."""
        raise NotImplementedError

    def forget(self) -> None:
        """Drop what is kept; needed after a change of the elements."""
        self._kept.clear()

    def _at(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        for kept, energy, force in self._kept:
            if np.array_equal(kept, x):
                return energy, force
        force = np.zeros_like(x)
        energy = self.evaluate(x, force)
        self._kept = [(x.copy(), energy, force), *self._kept[: KEPT - 1]]
        return energy, force

    def energy(self, x: np.ndarray) -> float:
        """Return the elastic energy [J] at positions ``x`` (n_nodes, 3) [m]."""
        return self._at(x)[0]

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the elastic nodal forces (n_nodes, 3) [N] at positions ``x``: minus the energy's gradient.

        Raises NotConverged where the energy is infinite, as some laws have it of inverted elements.
        """
        return self._finite(x).copy()

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        """Add the elastic nodal forces to ``force`` (n_nodes, 3) [N]."""
        force += self._finite(x)

    def _finite(self, x: np.ndarray) -> np.ndarray:
        energy, force = self._at(x)
        if self.forbids and energy == np.inf:
            raise NotConverged(
                "an element is flat or inverted, which its law forbids; choose stable_neo_hookean or corotational, "
                "a smaller step, or a smaller load",
                [],
            )
        return force
