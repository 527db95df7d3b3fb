"""Compliance: the response of the linearised body to a unit force at each contact, computed once and stored."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts, row_of
from palpate.bodies.refinement import with_midpoints
from palpate.effects.patch_load import nodal_load, patch_at, patch_shares
from palpate.solvers.equilibrium import Equilibrium

TOLERANCE = 1e-8
"""Relative residual of each response; models that are made of them are 1e-3 and more away from the truth."""
TOGETHER = 4
"""Contacts that are solved at once, so that the matrix is read once for twelve loads."""


@dataclass(frozen=True, eq=False)
class Compliance:
    """Linear responses [m/N] to unit forces along x, y and z at every contact that is prepared.

    contacts : (n_contacts,) coarse node numbers, increasing
    fine : (n_contacts, 3, n_surface, 3) fine surface displacements, by force direction
    restricted : (n_contacts, 3, n_coarse, 3) the same fine response at all coarse nodes
    coarse : (n_contacts, 3, n_coarse, 3) response of the coarse mesh itself
    seconds : time of its computation [s]
    means : (n_contacts, n_contacts, 3, 3) mean displacement of the first contact's disc by a unit force at the second,
        by force direction, with the shape functions of quadratic elements; None of linear ones
    """

    contacts: np.ndarray
    fine: np.ndarray
    restricted: np.ndarray
    coarse: np.ndarray
    seconds: float = 0.0
    means: np.ndarray | None = None

    def row(self, contact: int) -> int:
        """Return the row of coarse node ``contact``; InputError if it is not prepared."""
        return row_of(self.contacts, contact)


def compute_compliance(
    body: Body, radius_m: float, progress: Callable = iter, contacts: np.ndarray | int | None = None, order: int = 1
) -> Compliance:
    """Return the responses of the coarsest and finest level to unit forces at each contact (offline).

    progress : wraps the sequence of groups of contacts that are solved at once, as ``tqdm`` does
    contacts : their coarse nodes, increasing, or how many, which ``kept_contacts`` spreads; None for all
    order : of the finest level's elements; quadratic ones (2) need a level more, which ``with_midpoints`` gives
    """
    start = perf_counter()
    chosen = contacts if isinstance(contacts, np.ndarray) else kept_contacts(body, contacts)
    n_coarse, surface, finest = len(body.coarse.nodes), body.fine.surface, len(body.levels) - 1
    fine = np.empty((len(chosen), 3, len(surface), 3))
    restricted = np.empty((len(chosen), 3, n_coarse, 3))
    coarse = np.empty((len(chosen), 3, n_coarse, 3))
    whole = with_midpoints(body, finest) if order == 2 else body
    solve_fine = Equilibrium(whole, finest, order).linear_solver(TOLERANCE)
    patches = [patch_at(whole, contact, radius_m) for contact in chosen] if order == 2 else []
    discs = [patch_shares(whole.levels[finest], patch, order) for patch in patches]
    means = np.empty((len(discs), len(chosen), 3, 3))
    solve_coarse = Equilibrium(body, 0).linear_solver(TOLERANCE) if finest or order == 2 else solve_fine
    for group in progress(np.split(np.arange(len(chosen)), range(TOGETHER, len(chosen), TOGETHER))):
        response = solve_fine(_unit_loads(whole, finest, chosen[group], radius_m, order))
        fine[group], restricted[group] = _by_contact(response[surface]), _by_contact(response[:n_coarse])
        for disc, (nodes, shares) in enumerate(discs):
            means[disc, group] = _by_contact(shares @ np.moveaxis(response[nodes], 0, 1))
        coarse[group] = _by_contact(solve_coarse(_unit_loads(body, 0, chosen[group], radius_m)))
    return Compliance(chosen, fine, restricted, coarse, perf_counter() - start, means if discs else None)


def _unit_loads(body: Body, level: int, contacts: np.ndarray, radius_m: float, order: int = 1) -> np.ndarray:
    """Return nodal forces (n_nodes, 3, 3 k) [N] of unit forces along x, y and z on each of k ``contacts``."""
    pairs = [(int(contact), unit) for contact in contacts for unit in np.eye(3)]
    return np.stack([nodal_load(body, level, contact, unit, radius_m, order) for contact, unit in pairs], axis=2)


def _by_contact(responses: np.ndarray) -> np.ndarray:
    """Return ``responses`` (..., 3 k) as (k, 3, ...), by contact and direction of the force."""
    return np.moveaxis(responses, -1, 0).reshape(-1, 3, *responses.shape[:-1])
