"""Answer one press after another with finite elements on one level of a body, to convergence or stopped early."""

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, refuse, row_of
from palpate.effects.patch_load import disc_weights
from palpate.models.model import Case, Setting
from palpate.solvers.equilibrium import Equilibrium


class Simulation:
    """Static equilibrium of ``level`` under a force at a contact.

    tolerance : relative residual to stop at
    iterations : cap on Newton's iterations, or None for as many as it takes, with smaller loads in between. With a
        cap, the answer is what the last iteration reached: its error is measured, and its residual is not checked.
    """

    def __init__(self, case: Case, level: int, tolerance: float, iterations: int | None = None):
        self._equilibrium = Equilibrium(case.body, level)
        self._rest = self._equilibrium.mesh.nodes
        self._tolerance, self._iterations = tolerance, iterations
        self._shares = ContactShares(case.body, level, case.radius_m)

    def displacement(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] of all nodes; NotConverged, or InputError for a bad contact."""
        load = np.zeros_like(self._rest)
        nodes, shares = self._shares.of(contact)
        load[nodes] = np.outer(shares, force)
        if self._iterations is None:
            return self._equilibrium.solve(load, self._tolerance).x - self._rest
        return self._equilibrium.approach(load, self._tolerance, self._iterations).x - self._rest


class LinearCoarse:
    """The coarse mesh's linear response, computed in advance: three stored columns for each contact."""

    def __init__(self, case: Case):
        compliance = case.use_compliance()
        self._contacts, self._columns = compliance.contacts, compliance.coarse

    def displacement(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] of all coarse nodes under ``force`` (3,) [N]; InputError as above."""
        return np.tensordot(force, self._columns[row_of(self._contacts, contact)], 1)


class ContactShares:
    """For each contact: the nodes of ``level`` that carry its force, and the share of it that each carries."""

    def __init__(self, body: Body, level: int, radius_m: float):
        up = _to_fine(body, level)
        self._shares: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        for contact in contacts_of(body):
            weights = up.T @ disc_weights(body.fine, contact, radius_m)
            nodes = np.flatnonzero(weights)
            self._shares[int(contact)] = nodes, weights[nodes]

    def of(self, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Return node numbers and shares of one contact; InputError if it cannot be pressed."""
        if contact not in self._shares:
            refuse(contact)
        return self._shares[contact]


def solver_options(case: Case, setting: Setting) -> dict:
    """Return what ``setting`` says of a simulation: a cap on the iterations, or the tolerance."""
    return {"tolerance": setting.get("tolerance", case.tolerance), "iterations": setting.get("iterations")}


def to_surface(body: Body, level: int) -> sparse.csr_array:
    """Return the linear interpolation from the nodes of ``level`` to the fine surface nodes, (n_surface, n_level)."""
    return _to_fine(body, level)[body.fine.surface].tocsr()


def _to_fine(body: Body, level: int) -> sparse.csr_array:
    up = sparse.eye_array(len(body.fine.nodes), format="csr")
    for prolongation in reversed(body.prolongations[level % len(body.levels) :]):
        up = up @ prolongation
    return up
