"""Ask for loads that models were not prepared for: other places, two contacts, depths, presses beyond the design."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Judge, TruthErrors, truth_errors
from palpate.benchmark.load import DEPTH, NEW, PREPARED, TWO, Answer, Load, Press, Refused, displacement_of
from palpate.benchmark.measuring import DOUBTED, FAILED, REASON, REFUSED, Call, Kind, Prepared, Row, measure
from palpate.benchmark.model import Case, Model, Solver, answered
from palpate.benchmark.press_measure import labels_of, prepared_settings
from palpate.benchmark.presses import Sample
from palpate.benchmark.static_responses import StaticSolver
from palpate.bodies.contacts import places_between
from palpate.bodies.refinement import quadratic_prolongation
from palpate.effects.patch_load import patch_shares
from palpate.errors import InputError, NotConverged
from palpate.models.contact_modes.offline import Offline
from palpate.table_declaration import Table

SHARE = 0.7
"""Share of its force that each of two presses at once has, lest both turn an element inside out that one would not."""
APART = 2.0
"""Radii that two contacts are apart at least: their patches do not overlap."""


class Question(NamedTuple):
    """A load that models are asked for, and the fine operator's answer.

    truth : displacement (n_surface, 3) [m], None where it has no sound one; forces : (presses, 3) [N]
    patch : (n_surface,) bool, the nodes that are pressed
    """

    kind: str
    load: Load
    truth: np.ndarray | None
    forces: np.ndarray
    patch: np.ndarray

    def errors(self, answer: np.ndarray) -> TruthErrors:
        """Measure an answer (n_surface, 3) [m]; NaN where there is no sound one."""
        if self.truth is None:
            return TruthErrors(*[np.nan] * len(TruthErrors._fields))
        return truth_errors(answer, self.truth, self.patch)


def questions(case: Case, judge: Judge, count: int, tolerance: float, progress: Callable = iter) -> list[Question]:
    """Return ``count`` questions of each kind of load, fewer where test samples are few or an element is inverted.

    tolerance : relative residual of the answers; progress : wraps the loads that have to be solved
    Prepared contacts are those of test samples, whose answers are known. Places never prepared are fine surface nodes
    far from all prepared contacts, pressed inward with the force of the nearest sample. Two contacts are a test
    sample's and the nearest one that is APART. A depth is how far a test sample's force moves its disc.
    """
    tests = np.flatnonzero(judge.side == "test")
    chosen = tests[np.unique(np.linspace(0, len(tests) - 1, count).round().astype(int))]
    samples, body = judge.samples, case.body
    operator = StaticSolver(body, len(body.levels) - 1, 2)
    single_loads = [Load.at(samples.contact[i], samples.force[i]) for i in chosen]
    collected = [_question(case, PREPARED, load, samples.fine[i]) for i, load in zip(chosen, single_loads, strict=True)]
    to_solve = [(NEW, load) for load in _between(case, judge, count)]
    to_solve += [(TWO, load) for load in _pairs(case, judge, chosen)] + [(DEPTH, load) for load in single_loads]
    for kind, load in progress(to_solve):
        sample = Sample(0, load, case.radius_m)
        try:
            solution, (least_det, _) = operator.solve(sample, tolerance)
        except NotConverged:
            continue
        if least_det > 0.0:
            moved = solution.x - operator.mesh.nodes
            question = _question(case, kind, load, moved[body.fine.surface])
            if kind == DEPTH:
                discs = [patch_shares(body.fine, patch, 2) for patch in sample.patches(body)]
                depths = [
                    Press(press.node, moved=shares @ moved[nodes])
                    for press, (nodes, shares) in zip(load.presses, discs, strict=True)
                ]
                question = question._replace(load=Load(tuple(depths)))
            collected.append(question)
    return collected


def _question(case: Case, kind: str, load: Load, truth: np.ndarray | None) -> Question:
    """Return a question about a load by forces; truth : the fine operator's answer, as ``Question`` has it."""
    patch = Sample(0, load, case.radius_m).pressed(case.body)
    return Question(kind, load, truth, np.array([force for _, force in load.forces()]), patch)


def _between(case: Case, judge: Judge, count: int) -> Iterator[Load]:
    """Yield presses at ``count`` places between the prepared contacts, each by the force of the nearest sample."""
    body = case.body
    contact = np.concatenate([case.database.contact, judge.samples.contact])
    force = np.concatenate([case.database.force, judge.samples.force])
    prepared = case.prepared_contacts if len(case.prepared_contacts) else np.unique(contact)
    for node in places_between(body, count, prepared):
        nearest = np.argmin(np.linalg.norm(body.coarse.nodes[contact] - body.fine.nodes[node], axis=1))
        yield Load.at(int(node), -np.linalg.norm(force[nearest]) * body.fine.normals[node])


def _pairs(case: Case, judge: Judge, chosen: np.ndarray) -> Iterator[Load]:
    """Yield presses at two contacts at once: that of each of the ``chosen`` samples, and the nearest one APART."""
    nodes, samples = case.body.coarse.nodes, judge.samples
    for i in chosen:
        distance = np.linalg.norm(nodes[samples.contact] - nodes[samples.contact[i]], axis=1)
        distance[distance < APART * max(case.radius_m, 1e-9)] = np.inf
        if np.isfinite(distance).any():
            pair = (i, int(np.argmin(distance)))
            yield Load(tuple(Press(int(samples.contact[j]), SHARE * samples.force[j]) for j in pair))


LARGEST_OF = ("rmse_of_peak", "patch_rms_of_peak", "force_error")
"""The errors whose largest one is tabulated beside their mean: there are few loads of a kind."""
ANY_LOAD = Table(
    "any_load",
    "Loads that models were not prepared for, against the fine operator: new places, two contacts, a disc to a depth.",
    """
    scene body regime model setting kind: what is asked, and the kind of load
    samples refused doubted failures contacts: loads; refused beforehand, doubted, failed; places that were answered
    rmse_of_peak relative_l2 patch_rms_of_peak patch_max_of_peak force_error: mean errors; of the force of a pushed disc
    rmse_of_peak_most patch_rms_of_peak_most force_error_most: the largest of them
    online_median_s online_p95_s online_max_s: times of an answer: median, 95th percentile, and of the slowest load [s]
    preparation_s: time beforehand for one press [s]
    offline_s memory_mb failure: preparation of all contacts [s], memory [1e6 bytes], and the first reason
    """,
    always=False,
)


class AnyLoad(Kind):
    """Questions of one kind of load, against the fine operator.

    places : by the nodes that a load presses at once, the time that a solver took to prepare one of them [s], None
        where it prepares nothing; ``ready`` adds to it
    """

    errors = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak", "patch_max_of_peak", "force_error")

    def __init__(
        self, labels: Row, questions: Sequence[Question], place: str, places: dict[tuple[int, ...], float | None]
    ):
        super().__init__(labels, [{}] * len(questions), len(questions[0].patch), place)
        self._asked, self._places = questions, places

    def ready(self, solver: Solver, i: int) -> None:
        """Prepare the nodes of the i-th load, unless that has been done."""
        nodes = self._nodes(i)
        if nodes not in self._places:
            seconds = _refusing(solver.prepare_nodes, nodes)
            self._places[nodes] = None if seconds is None else seconds / len(nodes)

    def call(self, solver: Solver, i: int) -> Call:
        _refusing(solver.precede, self._asked[i].load)
        return partial(_refusing, solver.respond, self._asked[i].load)

    def judged(self, i: int, answer: np.ndarray | Answer) -> Row:
        """Measure an answer to the i-th load; where discs are pushed to a depth, the error of their forces, too."""
        question, forces = self._asked[i], answer.forces if isinstance(answer, Answer) else None
        columns: Row = question.errors(displacement_of(answer))._asdict()
        if forces is not None and any(press.moved is not None for press in question.load.presses):
            columns["force_error"] = float(np.linalg.norm(forces - question.forces) / np.linalg.norm(question.forces))
        return columns

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Return the largest errors, how many loads were refused, doubted and failed, and the time of preparing one."""
        reasons, errors = [row[REASON] for row in rows], pd.DataFrame(rows, columns=LARGEST_OF, dtype=float)
        columns: Row = errors.max().add_suffix("_most").to_dict()
        columns |= {"refused": reasons.count(REFUSED), "doubted": reasons.count(DOUBTED)}
        columns |= {"failures": reasons.count(FAILED)}
        answered = {self._nodes(i) for i, reason in enumerate(reasons) if not reason}
        if answered:
            times_s = [self._places.get(nodes) for nodes in {self._nodes(i) for i in range(len(rows))}]
            columns["preparation_s"] = float(np.median([each for each in times_s if each is not None] or [0.0]))
        return columns | {"contacts": len(answered)}, []

    def _nodes(self, i: int) -> tuple[int, ...]:
        return tuple(press.node for press in self._asked[i].load.presses)


def _refusing(function: Callable, asked: Any) -> Any:
    """Call a function of a solver; raise Refused where it raises InputError: for a contact that it cannot press."""
    try:
        return function(asked)
    except InputError as failure:
        raise Refused(str(failure)) from failure


def measure_any(
    case: Case,
    name: str,
    models: Sequence[Model],
    pattern: str,
    loads: Sequence[Question],
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Measure the models in whose text ``pattern`` is found: a row for each kind of load, the columns of ANY_LOAD.

    repeats, budget_s : of each kind, as ``time_calls`` takes them; progress : wraps the sequence of settings
    Errors are against the fine operator. On one BLAS thread.
    """
    rows = []
    place = models[0].place if models else ""
    for setting in prepared_settings(case, name, models, pattern, progress):
        places: dict[tuple[int, ...], float | None] = {}
        frozen = setting._replace(used=dict(setting.used))  # what loads prepare later is no part of the offline time
        for kind in dict.fromkeys(question.kind for question in loads):
            of_kind = labels_of(case) | {"kind": kind}, [question for question in loads if question.kind == kind]
            rows += measure(AnyLoad(*of_kind, place, places), [frozen], repeats, budget_s)[1]
    return ANY_LOAD.frame(rows)


TIMES = {"as designed": 1.0, "1.5 times": 1.5, "2 times": 2.0, "3 times": 3.0}
TANGENTIAL, PULLING = "tangential", "pulling"
RIGHT, RIGHT_AT_PATCH = 0.01, 0.05
"""Largest error of an answer that is called right, as a share of the peak: RMSE, and at the worst node of the disc."""
MOST_ITERATIONS, LEFT = 60, 1e-3
"""Steps of L-BFGS on the finest level at most (15 are usual), and the residual over the load at which it ends."""
BEYOND_DESIGN = Table(
    "beyond_design",
    "Presses that models were not made for: how many answers are right, doubted by the model itself, or wrong.",
    """
    scene body regime model setting kind: what is asked, and the kind of press
    samples unsound: presses, and those that have no answer that would be right
    right doubted needless wrong: answers that are right, doubted, doubted needlessly, and wrong without a word
    rmse_most patch_max_most: largest errors of those that are not doubted [peak]
    """,
    always=False,
)


def presses_beyond(case: Case, judge: Judge, count: int, progress: Callable = iter) -> list[Question]:
    """Press ``count`` contacts of test samples by the largest force there, times TIMES, along the surface, and outward.

    A press is unsound, and has no truth, where quadratic elements on the finest level find no answer, or an element
    of it is inverted.
    """
    body, samples = case.body, judge.samples
    test_rows = np.flatnonzero(judge.side == "test")
    newtons = np.linalg.norm(samples.force, axis=1)
    contacts = [test_rows[samples.contact[test_rows] == node] for node in np.unique(samples.contact[test_rows])]
    hardest = [samples_there[np.argmax(newtons[samples_there])] for samples_there in contacts]
    chosen = np.unique(np.linspace(0, len(hardest) - 1, count).round().astype(int))
    operator, collected = _Beyond(case), []
    for i in progress([hardest[row] for row in chosen]):
        node = int(samples.contact[i])
        for kind, force in _forces(samples.force[i], body.coarse.normals[node]):
            collected.append(_question(case, kind, Load.at(node, force), operator.answer(node, force)))
    return collected


def measure_beyond(
    case: Case, name: str, models: Sequence[Model], pattern: str, asked: Sequence[Question]
) -> pd.DataFrame:
    """Judge the models in whose text ``pattern`` is found: a row for each kind of press, as BEYOND_DESIGN has it."""
    rows = []
    for setting in prepared_settings(case, name, models, pattern):
        if isinstance(setting.solver, NotConverged):
            raise setting.solver
        labels = labels_of(case) | setting.about
        for kind in dict.fromkeys(press.kind for press in asked):
            of_kind = [press for press in asked if press.kind == kind]
            verdicts, *errors = zip(*(_judged(setting.solver, press) for press in of_kind), strict=True)
            row = labels | {"kind": kind, "samples": len(of_kind)}
            row |= {name: verdicts.count(name) for name in ("right", "needless", "wrong")}
            row |= {"unsound": sum(press.truth is None for press in of_kind)}
            row |= {"doubted": verdicts.count("doubted") + verdicts.count("needless")}
            row["rmse_most"], row["patch_max_most"] = map(np.fmax.reduce, errors)
            rows.append(row)
    return BEYOND_DESIGN.frame(rows)


def _judged(solver: Solver, press: Question) -> tuple[str, float, float]:
    """Return whether an answer is right, doubted, needlessly doubted or wrong, and its two errors if it was given."""
    try:
        solver.precede(press.load)
        answer, doubt = answered(solver, press.load, len(press.patch))
    except NotConverged:
        return "doubted", np.nan, np.nan
    error = press.errors(answer.displacement)
    is_right = error.rmse_of_peak <= RIGHT and error.patch_max_of_peak <= RIGHT_AT_PATCH
    if doubt:
        return "needless" if is_right else "doubted", np.nan, np.nan
    return "right" if is_right else "wrong", error.rmse_of_peak, error.patch_max_of_peak


def _forces(force: np.ndarray, normal: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield kinds of press and their forces (3,) [N]: ``force`` times TIMES, one along the surface, and outward."""
    for kind, times in TIMES.items():
        yield kind, times * force
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    size = np.linalg.norm(force)
    yield TANGENTIAL, size * across / np.linalg.norm(across)
    yield PULLING, size * normal


class _Beyond:
    """Quadratic elements on the finest level, whose search starts from the answer of the level before."""

    def __init__(self, case: Case):
        self._levels = Offline(case.body, case.radius_m, 0)
        self._body, self._last = case.body, len(case.body.levels) - 1
        self._up = quadratic_prolongation(*case.body.levels[-2:])

    def answer(self, node: int, force: np.ndarray) -> np.ndarray | None:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N], or None where there is no sound one."""
        coarser, finest = self._levels.elements(self._last - 1), self._levels.elements(self._last)
        load = coarser.nodal(*self._levels.disc(node, self._last - 1), force)
        start = coarser.settle(load, np.zeros_like(coarser.rest), MOST_ITERATIONS, LEFT)
        load = finest.nodal(*self._levels.disc(node, self._last), force)
        moved = finest.settle(load, self._up @ start, MOST_ITERATIONS, LEFT)
        residual = np.linalg.norm(finest.force(moved) + load)
        if not (residual <= LEFT * np.linalg.norm(load) and finest.least_det(moved) > 0.0):
            return None
        return moved[self._body.fine.surface]
