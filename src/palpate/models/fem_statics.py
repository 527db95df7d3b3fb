"""Finite elements asked for one press after another on one level of a body, as well or as briefly as is wanted."""

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.effects.patch_load import disc_weights
from palpate.errors import InputError
from palpate.models.model import Case
from palpate.solvers.equilibrium import Equilibrium


class Simulation:
    """Static equilibrium of ``level`` under a force at a contact.

    tolerance : relative residual to stop at
    iterations : Newton iterations at most, or None for as many as it takes, with smaller loads in between. What is
        reached in so many is an answer like any other: its error is measured and not its residual.
    """

    def __init__(self, case: Case, level: int, tolerance: float, iterations: int | None = None):
        self._equilibrium = Equilibrium(case.body, level)
        self._rest = self._equilibrium.mesh.nodes
        self._tolerance, self._iterations = tolerance, iterations
        self._shares = contact_shares(case.body, level, case.radius_m)

    def displacement(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacements (n_nodes, 3) [m] of all nodes of the level; NotConverged, or InputError for a bad contact."""
        load = np.zeros_like(self._rest)
        nodes, shares = share_of(self._shares, contact)
        load[nodes] = np.outer(shares, force)
        if self._iterations is None:
            return self._equilibrium.solve(load, self._tolerance).x - self._rest
        return self._equilibrium.approach(load, self._tolerance, self._iterations).x - self._rest


class LinearCoarse:
    """The coarse mesh's linear response, worked out beforehand: three stored columns a contact."""

    def __init__(self, case: Case):
        self._contacts, self._columns = case.compliance.contacts, case.compliance.coarse

    def displacement(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacements (n_nodes, 3) [m] of all coarse nodes under ``force`` (3,) [N]; InputError for a bad contact."""
        row = int(np.searchsorted(self._contacts, contact))
        if row == len(self._contacts) or self._contacts[row] != contact:
            raise InputError(no_contact(contact))
        return np.tensordot(force, self._columns[row], 1)


Shares = dict[int, tuple[np.ndarray, np.ndarray]]


def contact_shares(body: Body, level: int, radius_m: float) -> Shares:
    """For each contact that can be pressed: nodes of ``level`` that carry its force, and their shares of it."""
    up, shares = _to_fine(body, level), {}
    for contact in np.setdiff1d(body.coarse.surface, body.anchors[0]):
        weights = up.T @ disc_weights(body.fine, contact, radius_m)
        nodes = np.flatnonzero(weights)
        shares[int(contact)] = nodes, weights[nodes]
    return shares


def share_of(shares: Shares, contact: int) -> tuple[np.ndarray, np.ndarray]:
    """One contact's entry; InputError if it cannot be pressed."""
    if contact not in shares:
        raise InputError(no_contact(contact))
    return shares[contact]


def no_contact(contact: int) -> str:
    """What is said of a node that cannot be pressed."""
    return f"contact {contact} is no free surface node of the coarse mesh; choose one that is."


def to_surface(body: Body, level: int) -> sparse.csr_array:
    """Linear interpolation from the nodes of ``level`` to the fine surface nodes, (n_surface, n_level)."""
    return _to_fine(body, level)[body.fine.surface].tocsr()


def _to_fine(body: Body, level: int) -> sparse.csr_array:
    up = sparse.eye_array(len(body.fine.nodes), format="csr")
    for prolongation in reversed(body.prolongations[level % len(body.levels) :]):
        up = up @ prolongation
    return up
