"""Answer with the cheapest model whose bound meets the error that is asked for, and with the next one otherwise.

Each stage is a model that learns nothing from samples, so that the training samples say how wrong it is at contacts
that it has not seen: a factor times an estimate bounds the error of nine answers in ten (``conformal``). The estimate
is the share by which turning the linear response with its own rotations changes it, or the model's own. These errors
are those against the limit of nested levels, extrapolated from the fine answers of the training samples; a bound of
what is not known of that limit is added.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.benchmark.conformal import bound_factor
from palpate.benchmark.load import Answer, Doubted, Load, displacement_of, loads_of
from palpate.benchmark.model import Case, Model, Solver, held_mb
from palpate.benchmark.richardson import RATIOS, doubt, limit, ratio
from palpate.bodies.contacts import row_of
from palpate.errors import InputError, NotConverged
from palpate.models import kinds
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.warped_response import WarpedResponse
from palpate.solvers.equilibrium import FastEquilibrium

_SHARE = (1 / 3, 1 / 1.2)
"""Of the last halving's change, what all further ones add: ratios of convergence of 4 and of 2.2, where two levels
show none."""
_TOLERANCE = 1e-4
"""Relative residual of the elements of the levels below, whose own error is far larger."""


class Limits:
    """The training samples, and the limit of nested levels for each; those without an answer on a level are left out.

    loads : k of them; contact : (k,); fine : (k, n_surface, 3) [m], the limit
    beyond : the median distance of the fine answers from it, RMSE over peak
    unknown : a bound of how far that is from the truth, RMSE over peak; infinite of too few contacts
    """

    def __init__(self, case: Case):
        db, last = case.use_training(), len(case.body.levels) - 1
        below = [
            (Simulation(case, level, _TOLERANCE, order=2, solver=FastEquilibrium), to_surface(case.body, level, 2))
            for level in range(max(0, last - 2), last)
        ]
        contact, self.loads, fine, beyond, unknown = [], [], [], [], []
        for load, at, answer in zip(loads_of(db.contact, db.force), db.contact, db.fine, strict=True):
            try:
                levels = np.array([*(up @ level.displacement(load) for level, up in below), answer])
            except NotConverged:
                continue
            extrapolated, uncertainty = _limit(levels)
            contact.append(at)
            self.loads.append(load)
            fine.append(extrapolated)
            beyond.append(distance(answer, extrapolated))
            unknown.append(distance(extrapolated + uncertainty, extrapolated))
        self.contact, self.fine = np.array(contact), np.array(fine)
        self.beyond = float(np.median(beyond)) if beyond else np.inf
        self.unknown = bound_factor(np.array(unknown), self.contact)


def _limit(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the limit (n, 3) [m] of ``levels`` (m, n, 3) [m], and how far it may be from the truth."""
    if len(levels) > 2 and RATIOS[0] <= ratio(levels) <= RATIOS[1]:
        return limit(levels), doubt(levels)
    least, most = _SHARE
    change = levels[-1] - levels[-2]
    return levels[-1] + 0.5 * (least + most) * change, 0.5 * (most - least) * change


def distance(answer: np.ndarray, reference: np.ndarray) -> float:
    """Return the RMS distance of two displacements (n_surface, 3) [m] over the peak of the second."""
    return float(np.sqrt(np.mean(np.sum((answer - reference) ** 2, axis=1))) / np.linalg.norm(reference, axis=1).max())


_LEAST = 1e-6
"""Estimates [of the peak] below this count as so much."""
_SMALL = 1e-4
"""Displacement over the body's size at which the second order of turning is found."""


class CascadeStage(NamedTuple):
    """A prepared model and the factor of its estimate.

    own : whether the estimate is the model's own, which is known once it has answered
    seconds : the longest that it takes for a training sample [s], the lesser of two times, as the first may compile
    """

    solver: Solver
    factor: float
    own: bool
    seconds: float = 0.0


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
        squared = force @ near @ force
        return self._floor + (sqrt(max(products @ bent @ products, 0.0) / squared) if squared > 0 else 0.0)


def _second_order(answer: Any, small: float) -> np.ndarray:
    """Return the second derivatives over 2, (3, 3, n, 3), of a response to forces (3,) by differences of ``small``."""
    unit, rest = small * np.eye(3), answer(np.zeros(3))

    def square(force: np.ndarray) -> np.ndarray:
        return 0.5 * (answer(force) + answer(-force)) - rest

    own = [square(each) for each in unit]
    derivatives = np.empty((3, 3, *rest.shape))
    for i in range(3):
        derivatives[i, i] = own[i]
        for j in range(i):
            derivatives[i, j] = derivatives[j, i] = 0.5 * (square(unit[i] + unit[j]) - own[i] - own[j])
    return derivatives / small**2


def prepared_stage(case: Case, turning: Turning, limits: Limits, model: Model) -> CascadeStage:
    """Prepare the ``model`` of a stage, and find its factor; what it does not answer is no part of it."""
    solver = _prepared(case, model)
    contact, errors, turned, own, longest = [], [], [], [], 0.0
    for at, load, fine in zip(limits.contact, limits.loads, limits.fine, strict=True):
        solver.precede(load)
        answer, seconds = _timed(solver, load)
        if seconds > longest:
            longest = max(longest, min(seconds, _timed(solver, load)[1]))
        if answer is None:
            continue
        contact.append(at)
        errors.append(distance(displacement_of(answer), fine))
        turned.append(turning.of(load))
        own.append(own_estimate(answer))
    by_itself = bool(contact) and bool(np.isfinite(own).all())
    factor = bound_factor(np.array(errors) / np.array(own if by_itself else turned), np.array(contact))
    return CascadeStage(solver, factor, by_itself, longest)


def _timed(solver: Solver, load: Load) -> tuple[np.ndarray | Answer | None, float]:
    """Return a model's answer, None if it has none that it believes, and what that has taken [s]."""
    begin = perf_counter()
    try:
        answer: np.ndarray | Answer | None = solver.respond(load)
    except NotConverged:
        answer = None
    return answer, perf_counter() - begin


def _prepared(case: Case, model: Model) -> Solver:
    """Prepare the model of a stage; InputError for one that learns.

    Bounds are found on the training contacts, which a stage that learns from them has seen.
    """
    limits = case.used.pop("training", None)
    solver = model.prepare(case)
    if "training" in case.used:
        raise InputError(
            f"tradeoff.settings.cascade.stages: {model.name} learns from the samples that bounds are found on; take a "
            "model that learns nothing."
        )
    if limits is not None:
        case.charge("training", limits)
    return solver


def own_estimate(answer: np.ndarray | Answer) -> float:
    """Return the model's own estimate of its error, at least _LEAST; not finite where it has none."""
    return max(answer.error, _LEAST) if isinstance(answer, Answer) and answer.error is not None else np.inf


class Prepared(NamedTuple):
    """All that settings share.

    turning : the estimate; unknown : the bound of what is not known of the limit; stages : cheapest first
    case : that they were prepared with, in which what they use is charged
    """

    turning: Turning
    unknown: float
    stages: list[CascadeStage]
    case: Case


class CascadeSolver(Solver):
    """Try one stage after another; where none is sure enough the surest answers, and says how sure it is.

    A stage is left out that has taken longer, for any training sample, than is left of the budget. What stages before
    it have taken counts as the longest that they have taken, so that the same load gets the same answer every time.
    """

    def __init__(self, case: Case, prepared: Prepared, asked: float, budget_ms: float = np.inf):
        """Take the case to charge, what was prepared, the error that is asked for, and the time there is."""
        self._case, self._prepared, self._asked, self._budget_ms = case, prepared, asked, budget_ms
        self._charge()

    @property
    def memory_mb(self) -> float:
        return held_mb(self._prepared.turning) + sum(stage.solver.memory_mb for stage in self._prepared.stages)

    def precede(self, load: Load) -> None:
        """Do what stages do before a query, such as preparing its contact; not timed, but charged."""
        for stage in self._prepared.stages:
            stage.solver.precede(load)
        self._charge()

    def respond(self, load: Load) -> Answer:
        """Answer with a bound of its error; errors as the last one tried, Doubted where a surer one is too slow."""
        turned, stages = self._prepared.turning.of(load), self._prepared.stages
        untried: list[tuple[float, int, Answer | None]] = []
        spent, late, doubted = 0.0, "", None
        for place, stage in enumerate(stages):
            bound, answer = 0.0 if stage.own else self._bound(stage, turned), None
            if why := self._too_late(stage, spent):
                late = late or why
                continue
            if bound <= self._asked:
                spent += stage.seconds
                try:
                    answer = self._answer(stage, load, turned)
                except NotConverged as failure:
                    doubted = failure.answer if isinstance(failure, Doubted) else doubted
                    continue
                bound = np.inf if answer.error is None else answer.error
                if bound <= self._asked:
                    return answer
            untried.append((bound, -place, answer))
        try:
            surest = self._surest(sorted(untried, key=lambda each: each[:2]), load, turned, spent)
        except NotConverged:
            if not late or doubted is None:
                raise
            surest = doubted
        if late:
            raise Doubted(late, [spent], surest)
        return surest

    def _surest(
        self, candidates: list[tuple[float, int, Answer | None]], load: Load, turned: float, spent: float
    ) -> Answer:
        """Return the answer of the least bound, of those given and those that there is still time to ask for."""
        failure = NotConverged("no stage of the cascade has an answer", [float("nan")])
        for _, place, answer in candidates:
            stage = self._prepared.stages[-place]
            if answer is None and self._too_late(stage, spent):
                continue
            try:
                return answer or self._answer(stage, load, turned)
            except NotConverged as failed:
                failure = failed
        raise failure

    def _too_late(self, stage: CascadeStage, spent: float) -> str:
        """Return that a stage may take longer than what is left after ``spent`` [s], or nothing; no time is in it."""
        late = 1e3 * (spent + stage.seconds) > self._budget_ms
        return f"a surer stage does not fit the budget of {self._budget_ms:g} ms" if late else ""

    def _answer(self, stage: CascadeStage, load: Load, turned: float) -> Answer:
        """Return a stage's answer with the bound of its error, if the training contacts are enough for one."""
        answer = stage.solver.respond(load)
        bound = self._bound(stage, own_estimate(answer) if stage.own else turned)
        return Answer(displacement_of(answer), error=bound if bound < np.inf else None)

    def _bound(self, stage: CascadeStage, estimate: float) -> float:
        return self._prepared.unknown + stage.factor * estimate

    def _charge(self) -> None:
        """Add what the stages have used so far, in whichever setting's turn."""
        for what, seconds in self._prepared.case.used.items():
            self._case.charge(what, seconds)


def prepare(case: Case, model: kinds.Cascade) -> CascadeSolver:
    """Prepare every stage, and find its factor on the training samples, once for all that is asked for."""
    name = "cascade", case.database, case.response, repr(model.stages)
    prepared = case.share(name, lambda: _prepare_all(case, model.stages))
    return CascadeSolver(case, prepared, model.asked, model.budget_ms or np.inf)


def _prepare_all(case: Case, models: Sequence[Model]) -> Prepared:
    case = replace(case, used={})
    begin = perf_counter()
    limits = Limits(case)
    turning = Turning(case, limits.beyond)
    stages = [prepared_stage(case, turning, limits, model) for model in models]
    case.charge("stages", perf_counter() - begin)
    return Prepared(turning, limits.unknown, stages, case)
