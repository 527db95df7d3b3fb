"""The equilibrium of a body under an instrument by L-BFGS, whose constant matrix has the penalty of touching nodes.

The penalty is far above the body's stiffness, so that a descent along a matrix without it would creep. As few nodes
touch, the inverse with their penalties follows from the one without by the Woodbury identity, which takes one column of
that inverse for each of them.
"""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.effects.effect import Energy
from palpate.effects.instrument_penalty import NodeContact
from palpate.linalg.minimiser import minimise_by_lbfgs

Solve = Callable[[np.ndarray], np.ndarray]
"""The product of the inverse of a constant matrix with forces (n, 3) [N], zero at held nodes."""
STILL = np.empty((0, 3))
"""What effects with an energy get for velocities, which they do not use."""


class PressedDescent:
    """The energy of ``effects`` and ``contact``, and its minimum by descents along a matrix that has both.

    held : (n,) bool; solve : of the constant matrix of the effects alone
    isotropic : whether that matrix is the same for x, y and z
    """

    def __init__(
        self, effects: Sequence[Energy], contact: NodeContact, held: np.ndarray, solve: Solve, isotropic: bool
    ):
        self._effects, self._contact, self._held = [*effects, contact], contact, held
        self._solve, self._isotropic = solve, isotropic
        self._columns: dict[int, np.ndarray] = {}

    def relax(self, x: np.ndarray, iterations: int, memory: int, tolerance: float) -> np.ndarray:
        """Return positions (n, 3) [m] after at most so many ``iterations`` from ``x`` (n, 3) [m].

        memory : number of earlier steps by which L-BFGS improves the matrix
        tolerance : of the residual, over the norm of the nodal forces of contact at ``x``
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
        """Solve with the matrix of effects, and of contact where ``force`` was last asked, for ``right`` [N]."""
        without = self._solve(right)
        overlaps, normals = self._contact.overlaps(self._at)
        touching = np.flatnonzero(overlaps)
        if not len(touching):
            return without
        nodes, normals = self._contact.nodes[touching], normals[touching]
        responses = np.array([np.tensordot(n, self._column(int(i)), 1) for i, n in zip(nodes, normals, strict=True)])
        # displacement along the normal of node k by a unit force along that of node j
        compliance = np.einsum("jki,ki->kj", responses[:, nodes], normals)
        compliance[np.diag_indices(len(touching))] += 1.0 / self._contact.stiffness_n_m[touching]
        pushes = np.linalg.solve(compliance, np.einsum("ki,ki->k", without[nodes], normals))
        return without - np.tensordot(pushes, responses, 1)

    def _column(self, node: int) -> np.ndarray:
        """Return the displacements (3, n, 3) [m/N] by unit forces along x, y and z at a node."""
        if node not in self._columns:
            columns = np.zeros((3, *self._at.shape))
            forces = np.zeros_like(columns)
            forces[:, node] = np.eye(3)
            if self._isotropic:
                response = self._solve(forces.sum(axis=0))
                columns[np.arange(3), :, np.arange(3)] = response.T
            else:
                columns[:] = [self._solve(unit) for unit in forces]
            self._columns[node] = columns
        return self._columns[node]
