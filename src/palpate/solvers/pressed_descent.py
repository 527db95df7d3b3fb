"""Press a body with an instrument by L-BFGS whose constant matrix has the stiffness of those nodes added that touch.

The stiffness of contact is far above the body's; a descent along a matrix without it would creep. The nodes that touch
are few, so that the matrix with them follows from that without by the Woodbury identity, with one column of the
inverse for each.
"""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.effects.effect import Energy
from palpate.effects.instrument_penalty import NodeContact
from palpate.linalg.minimiser import minimise_by_lbfgs

Solve = Callable[[np.ndarray], np.ndarray]
"""Applies the inverse of a constant matrix to (n, 3) [N]; held nodes stay at 0."""
STILL = np.empty((0, 3))
"""Energies ask for no velocities."""


class PressedDescent:
    """The energy of ``effects`` and of ``contact``, and descents along a matrix that has both.

    held : (n,) bool; solve : for the effects alone, with the matrix that ``isotropic`` says to be the same for x, y, z
    """

    def __init__(
        self, effects: Sequence[Energy], contact: NodeContact, held: np.ndarray, solve: Solve, isotropic: bool
    ):
        self._effects, self._contact, self._held = [*effects, contact], contact, held
        self._solve, self._isotropic = solve, isotropic
        self._columns: dict[int, np.ndarray] = {}

    def relax(self, x: np.ndarray, iterations: int, memory: int, tolerance: float) -> np.ndarray:
        """Return positions after so many iterations from ``x`` (n, 3) [m], or fewer.

        memory : how many steps the matrix is improved by
        tolerance : of the residual, relative to what the instrument pushes with at ``x``
        """
        scale = float(np.linalg.norm(self._contact.pushes(x)))
        return minimise_by_lbfgs(self, self._step, x, tolerance * scale, iterations, kept=memory).x

    def energy(self, x: np.ndarray) -> float:
        return sum(each.energy(x) for each in self._effects)

    def force(self, x: np.ndarray) -> np.ndarray:
        self._at, force = x, np.zeros_like(x)
        for each in self._effects:
            each.add_force(x, STILL, force)
        force[self._held] = 0.0
        return force

    def _step(self, right: np.ndarray) -> np.ndarray:
        """Solve with the stiffness of the nodes that touch where the force was last asked for."""
        free = self._solve(right)
        overlaps, normals = self._contact.overlaps(self._at)
        on = np.flatnonzero(overlaps)
        if not len(on):
            return free
        nodes, normals = self._contact.nodes[on], normals[on]
        moved = np.array([np.tensordot(n, self._column(int(i)), 1) for i, n in zip(nodes, normals, strict=True)])
        gives = np.einsum("jki,ki->kj", moved[:, nodes], normals)  # along the normal of k, by a force along that of j
        gives[np.diag_indices(len(on))] += 1.0 / self._contact.stiffness_n_m[on]
        pushes = np.linalg.solve(gives, np.einsum("ki,ki->k", free[nodes], normals))
        return free - np.tensordot(pushes, moved, 1)

    def _column(self, node: int) -> np.ndarray:
        """Return the displacements (3, n, 3) [m/N] by unit forces along x, y and z at a node."""
        if node not in self._columns:
            found = np.zeros((3, *self._at.shape))
            units = np.zeros_like(found)
            units[:, node] = np.eye(3)
            if self._isotropic:
                along = self._solve(units.sum(axis=0))
                found[np.arange(3), :, np.arange(3)] = along.T
            else:
                found[:] = [self._solve(unit) for unit in units]
            self._columns[node] = found
        return self._columns[node]
