"""Prepare the stages of a cascade, and find on training contacts what bounds their errors."""

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.benchmark.load import Answer, Load, displacement_of
from palpate.benchmark.model import Case, Solver
from palpate.bodies.contacts import row_of
from palpate.errors import InputError, NotConverged
from palpate.models.conformal import bound_factor
from palpate.models.enrichment.warped_response import WarpedResponse
from palpate.models.training_limits import Limits, distance

_LEAST = 1e-6
"""Estimates [of the peak] below this count as so much."""
_SMALL = 1e-4
"""Displacement over the body's size at which the second order of turning is found."""
LAST = "last"
"""The level of a stage's setting that is the body's finest."""


class Stage(NamedTuple):
    """A prepared model and the factor of its estimate.

    own : whether the estimate is the model's own, which is known once it has answered
    """

    solver: Solver
    factor: float
    own: bool


class Turning:
    """The share by which turning a linear response with its own rotations changes it, to the second order.

    RMS of the change over the coarse nodes, over the displacement of the contact. The change is a square of the force,
    so that a matrix (9, 9) of its products knows its mean square: it costs less than any answer.
    floor : added to it, for what errors consist of that no turning shows, such as that of the mesh
    """

    def __init__(self, case: Case, floor: float = _LEAST):
        self._floor = floor
        stored, meshes = case.use_compliance(), case.meshes
        same = sparse.eye_array(len(meshes.coarse_nodes), format="csr")
        turned = WarpedResponse(replace(meshes, prolongation=same), replace(stored, fine=stored.restricted))
        self._contacts, self._known = stored.contacts, {}
        for contact, columns in zip(stored.contacts, stored.restricted, strict=True):
            here = columns[:, contact, :]
            small = _SMALL * case.body.fine.size / np.abs(here).max()
            bent = _second_order(lambda force, at=contact: turned.answer(int(at), force)[0], small).reshape(9, -1)
            self._known[int(contact)] = here @ here.T, bent @ bent.T / len(columns[0])

    def of(self, load: Load) -> float:
        """Return the share with the floor; Refused for a load that is not one force, InputError for a bad contact."""
        contact, force = load.single()
        if contact not in self._known:
            row_of(self._contacts, contact)
        near, bent = self._known[contact]
        products = (force[:, None] * force).ravel()
        moved = force @ near @ force
        return self._floor + (sqrt(max(products @ bent @ products, 0.0) / moved) if moved > 0 else 0.0)


def _second_order(answer: Any, small: float) -> np.ndarray:
    """Return the second derivatives over 2, (3, 3, n, 3), of a response to forces (3,) by differences of ``small``."""
    unit, rest = small * np.eye(3), answer(np.zeros(3))

    def square(force: np.ndarray) -> np.ndarray:
        return 0.5 * (answer(force) + answer(-force)) - rest

    own = [square(each) for each in unit]
    found = np.empty((3, 3, *rest.shape))
    for i in range(3):
        found[i, i] = own[i]
        for j in range(i):
            found[i, j] = found[j, i] = 0.5 * (square(unit[i] + unit[j]) - own[i] - own[j])
    return found / small**2


def prepared_stage(case: Case, turning: Turning, limits: Limits, entry: Mapping[str, Any]) -> Stage:
    """Prepare the model of an ``entry`` of the grid, and find its factor; what it does not answer is no part of it."""
    solver = _prepared(case, entry["model"], entry.get("setting", {}))
    contact, errors, turned, own = [], [], [], []
    for at, load, fine in zip(limits.contact, limits.loads, limits.fine, strict=True):
        try:
            answer = solver.respond(load)
        except NotConverged:
            continue
        contact.append(at)
        errors.append(distance(displacement_of(answer), fine))
        turned.append(turning.of(load))
        own.append(own_estimate(answer))
    by_itself = bool(contact) and bool(np.isfinite(own).all())
    factor = bound_factor(np.array(errors) / np.array(own if by_itself else turned), np.array(contact))
    return Stage(solver, factor, by_itself)


def _prepared(case: Case, name: str, given: Mapping[str, Any]) -> Solver:
    """Prepare the model of a stage; InputError for a setting that it does not have, and for one that learns.

    Bounds are found on the training contacts, which a stage that learns from them has seen.
    """
    from palpate.models.model_registry import model

    stage, last, place = model(name, {}), len(case.body.levels) - 1, f"tradeoff.settings.cascade.stages: {name}"
    setting = {key: last if (key, value) == ("level", LAST) else value for key, value in given.items()}
    if setting.get("level", 0) not in range(last + 1):
        raise InputError(f"{place}.level is {setting['level']}; the body has the levels 0 to {last}, or {LAST}.")
    limits = case.used.pop("training", None)
    try:
        solver = stage.prepare(case, setting)
    except KeyError as missing:
        raise InputError(f"{place} lacks the setting {missing} or does not know it; see docs/glossary.md.") from missing
    if "training" in case.used:
        raise InputError(f"{place} learns from the samples that bounds are found on; take a model that learns nothing.")
    if limits is not None:
        case.charge("training", limits)
    return solver


def own_estimate(answer: np.ndarray | Answer) -> float:
    """Return the model's own estimate of its error, at least _LEAST; not finite where it has none."""
    return max(answer.error, _LEAST) if isinstance(answer, Answer) and answer.error is not None else np.inf
