"""Prepare the stages of a cascade, and find on training contacts what bounds their errors."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.enrichment.linear_fem import LinearFem
from palpate.enrichment.warped_response import WarpedResponse
from palpate.errors import NotConverged
from palpate.models.conformal import bound_factor
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.load import Answer, Load, displacement_of, loads_of
from palpate.models.model import Case, Solver

_LEAST = 1e-6
"""Estimates [of the peak] below this count as so much."""
_RATIO = 2.2
"""By how much a halving of the elements reduces their error at least, where the answer converges at all."""
_TOLERANCE = 1e-3
"""Relative residual of the elements of the level below, whose own error is far larger."""


class Stage(NamedTuple):
    """A prepared model and the factor of its estimate.

    own : whether the estimate is the model's own, which is known once it has answered
    """

    solver: Solver
    factor: float
    own: bool


class Turning:
    """The share by which turning a linear response with its own rotations changes it.

    RMS of the change over the coarse nodes, over the largest displacement of any; it costs less than the answer itself.
    """

    def __init__(self, case: Case):
        stored, meshes = case.use_compliance(), case.meshes
        coarse = replace(stored, fine=stored.restricted)
        self._linear = LinearFem(coarse)
        same = sparse.eye_array(len(meshes.coarse_nodes), format="csr")
        self._turned = WarpedResponse(replace(meshes, prolongation=same), coarse)

    def of(self, load: Load) -> float:
        """Return the share, at least _LEAST; Refused for a load that is not one force, InputError for a bad contact."""
        contact, force = load.single()
        flat = self._linear.predict(None, contact, force)
        change = self._turned.answer(contact, force)[0] - flat
        largest = np.einsum("ni,ni->n", flat, flat).max()
        mean = np.vdot(change, change) / len(change)
        return max(float(np.sqrt(mean / largest)), _LEAST) if largest > 0 else _LEAST


def prepared_stage(case: Case, turning: Turning, entry: Mapping[str, Any]) -> Stage:
    """Prepare the model of an ``entry`` of the grid, and find its factor; a sample without an answer has no bound."""
    from palpate.models.model_registry import model

    solver = model(entry["model"], {}).prepare(case, entry.get("setting", {}))
    db = case.use_training()
    errors, turned, own = [], [], []
    for load, fine in zip(loads_of(db.contact, db.force), db.fine, strict=True):
        turned.append(turning.of(load))
        try:
            answer = solver.respond(load)
        except NotConverged:
            errors.append(np.inf)
            own.append(1.0)
            continue
        errors.append(_distance(displacement_of(answer), fine))
        own.append(own_estimate(answer))
    by_itself = bool(np.isfinite(own).all())
    factor = bound_factor(np.array(errors) / (own if by_itself else turned), db.contact)
    return Stage(solver, factor, by_itself)


def mesh_bound(case: Case) -> float:
    """Bound the distance of the fine quadratic elements from their limit by that of the level below from them.

    Richardson's: what a halving changes, over _RATIO - 1. One sample of each training contact, the deepest.
    """
    db, level = case.use_training(), len(case.body.levels) - 2
    order = np.lexsort((-db.peaks, db.contact))
    deepest = order[np.unique(db.contact[order], return_index=True)[1]]
    below, up = Simulation(case, level, _TOLERANCE, order=2), to_surface(case.body, level, 2)
    changes = []
    for load, fine in zip(loads_of(db.contact[deepest], db.force[deepest]), db.fine[deepest], strict=True):
        try:
            changes.append(_distance(up @ below.displacement(load), fine))
        except NotConverged:
            changes.append(np.inf)
    return bound_factor(np.array(changes) / (_RATIO - 1.0), db.contact[deepest])


def _distance(moved: np.ndarray, fine: np.ndarray) -> float:
    """Return the RMS distance of two displacements (n_surface, 3) [m] over the peak of the second."""
    return float(np.sqrt(np.mean(np.sum((moved - fine) ** 2, axis=1))) / np.linalg.norm(fine, axis=1).max())


def own_estimate(answer: np.ndarray | Answer) -> float:
    """Return the model's own estimate of its error, at least _LEAST; not finite where it has none."""
    return max(answer.error, _LEAST) if isinstance(answer, Answer) and answer.error is not None else np.inf
