"""Answer one press after another with finite elements on one level of a body, to convergence or stopped early."""

from copy import copy
from typing import Self
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, row_of
from palpate.bodies.quadratic import prolongation
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.models.model import Case
from palpate.solvers.equilibrium import Equilibrium

_integrated: WeakKeyDictionary = WeakKeyDictionary()
"""Shares of patches, by body, and there by level, order, radius and contact."""


class Simulation:
    """Static equilibrium of ``level`` under a force at a contact, with linear or, of ``order`` 2, quadratic elements.

    tolerance : relative residual to stop at
    iterations : cap on Newton's iterations, or None for as many as it takes, with smaller loads in between. With a
        cap, the answer is what the last iteration reached: its error is measured, and its residual is not checked.
    """

    def __init__(self, case: Case, level: int, tolerance: float, iterations: int | None = None, order: int = 1):
        self._equilibrium = Equilibrium(with_unknowns(case.body, level, order), level, order)
        self._rest = self._equilibrium.mesh.nodes
        self._tolerance, self._iterations, self._converged = tolerance, iterations, case.tolerance
        self._shares = ContactShares(case, level, order)

    def stopped(self, tolerance: float, iterations: int | None) -> Self:
        """Return the same simulation with another stop; the two share their matrices."""
        other = copy(self)
        other._tolerance, other._iterations = tolerance, iterations
        return other

    def displacement(self, contact: int, force: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] of all nodes; NotConverged, or InputError for a bad contact.

        start : displacements (n_nodes, 3) [m] that Newton's method begins at, in place of rest
        """
        load, x = self.load(contact, force), None if start is None else self._rest + start
        if self._iterations is None:
            return self._equilibrium.solve(load, self._tolerance, x).x - self._rest
        return self._equilibrium.approach(load, self._tolerance, self._iterations, x).x - self._rest

    def settled(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] converged to the case's tolerance, whatever those of queries are."""
        return self._equilibrium.solve(self.load(contact, force), self._converged).x - self._rest

    def load(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return nodal forces (n_nodes, 3) [N]; InputError for a bad contact."""
        load = np.zeros_like(self._rest)
        nodes, shares = self._shares.of(contact)
        load[nodes] = np.outer(shares, force)
        return load

    def linear_columns(self, contacts: np.ndarray) -> np.ndarray:
        """Return linear responses to unit forces at ``contacts``, (n_contacts, 3, n_nodes, 3) [m/N]."""
        respond = self._equilibrium.linear_solver()
        return np.array([[respond(self.load(int(c), unit)) for unit in np.eye(3)] for c in contacts])


class LinearCoarse:
    """The coarse mesh's linear response, computed in advance: three stored columns for each contact."""

    def __init__(self, case: Case):
        compliance = case.use_compliance()
        self._contacts, self._columns = compliance.contacts, compliance.coarse

    def displacement(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] of all coarse nodes under ``force`` (3,) [N]; InputError as above."""
        return np.tensordot(force, self._columns[row_of(self._contacts, contact)], 1)


class ContactShares:
    """For each contact: the nodes that carry its force, and the share of it that each carries.

    The nodes are those of elements of ``order`` on ``level``. Patches of the prepared contacts are integrated in
    advance, and once for all models of a body; those of others at their first use.
    """

    def __init__(self, case: Case, level: int, order: int = 1):
        body, key = case.body, (level % len(case.body.levels), order, case.radius_m)
        self._mesh, self._order = body.levels[level], order
        self._patches = {int(c): patch_at(body, int(c), case.radius_m) for c in contacts_of(body)}
        self._contacts = np.array(sorted(self._patches))
        self._shares = _integrated.setdefault(body, {}).setdefault(key, {})
        for contact in case.prepared_contacts:
            self.of(int(contact))

    def of(self, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Return node numbers and shares of one contact; InputError if it cannot be pressed."""
        if contact not in self._shares:
            row_of(self._contacts, contact)
            self._shares[contact] = patch_shares(self._mesh, self._patches[contact], self._order)
        return self._shares[contact]


def with_unknowns(body: Body, level: int, order: int) -> Body:
    """Return ``body`` with the level that elements of ``order`` on ``level`` have their nodes on."""
    return finer(body) if order == 2 and level == len(body.levels) - 1 else body


def to_surface(body: Body, level: int, order: int = 1) -> sparse.csr_array:
    """Return the interpolation from the nodes of elements to the fine surface nodes, (n_surface, n_nodes).

    Linear elements on ``level`` interpolate linearly, those of ``order`` 2 quadratically; these have the nodes of the
    next level, which on the finest level are more than the fine ones.
    """
    surface = body.fine.surface
    if order == 2 and level == len(body.levels) - 1:
        columns = len(body.fine.nodes) + len(body.fine.edges)
        return sparse.eye_array(columns, format="csr")[surface].tocsr()
    up = sparse.eye_array(len(body.fine.nodes), format="csr")
    for start in range(len(body.levels) - order - 1, level - 1, -1):
        up = up @ (body.prolongations[start] if order == 1 else _quadratic(body, start))
    return up[surface].tocsr()


def _quadratic(body: Body, level: int) -> sparse.csr_array:
    """Interpolate from quadratic elements on ``level`` to those on the next one."""
    return prolongation(body.levels[level], body.levels[level + 1])
