"""Measure models under loads that they were not prepared for: other places, two contacts, discs pushed to a depth."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import truth_errors
from palpate.benchmark.load import Answer, Doubted, Load, Refused
from palpate.benchmark.measure import LABELS, labels_of
from palpate.benchmark.model import Case, Model, Solver, checked, setting_text
from palpate.benchmark.timing import said, time_calls
from palpate.errors import InputError, NotConverged
from palpate.studies.tradeoff.general_loads import Question

MEANS = ["rmse_of_peak", "relative_l2", "patch_rms_of_peak", "patch_max_of_peak", "force_error"]
MOST = ["rmse_of_peak", "patch_rms_of_peak", "force_error"]
"""The errors whose largest one is tabulated beside their mean: there are few loads of a kind."""
COLUMNS = [
    *LABELS, "kind", "samples", "refused", "doubted", "failures", "contacts", *MEANS,
    *(f"{name}_most" for name in MOST), "online_median_s", "online_p95_s", "preparation_s",
    "offline_s", "memory_mb", "failure",
]  # fmt: skip


def measure_any(
    case: Case,
    name: str,
    model: Model,
    pattern: str,
    asked: Sequence[Question],
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Measure those settings of ``model`` whose text ``pattern`` is found in: a row each kind of question, COLUMNS.

    repeats, budget_s : of each kind, as ``time_calls`` takes them; progress : wraps the sequence of settings
    Errors are means over what was answered, at so many ``contacts``, against the fine operator; ``refused`` of the
    ``samples`` are loads of a sort that the model does not answer, ``doubted`` those whose answer it does not believe,
    ``failures`` the others that it should have answered. ``preparation_s`` is the median time of what a solver prepares
    for a press beforehand, if it has ``prepare_contact(*nodes)``, or of what it counts itself in
    ``seconds_of(*nodes)``. On one BLAS thread.
    """
    from threadpoolctl import threadpool_limits

    rows: list[dict] = []
    with threadpool_limits(limits=1):
        for setting in progress([s for s in model.settings(case) if re.search(pattern, setting_text(s))]):
            fresh = replace(case, used={})
            start = perf_counter()
            try:
                solver: Solver | NotConverged = model.prepare(fresh, setting)
            except NotConverged as failure:
                solver = failure
            told = labels_of(case, name, setting_text(setting))
            offline = perf_counter() - start + sum(fresh.used.values())
            ready: dict[tuple[int, ...], float] = {}
            for kind in dict.fromkeys(question.kind for question in asked):
                one = [question for question in asked if question.kind == kind]
                found = {**told, "kind": kind, "samples": len(one), "offline_s": offline}
                if isinstance(solver, NotConverged):
                    rows.append(
                        found
                        | {"refused": 0, "doubted": 0, "failures": len(one), "contacts": 0, "failure": said(solver)}
                    )
                else:
                    rows.append(found | _asked(solver, one, ready, repeats, budget_s, case.n_surface, model.place))
    return pd.DataFrame(rows, columns=COLUMNS)


def _asked(
    solver: Solver,
    questions: Sequence[Question],
    ready: dict[tuple[int, ...], float],
    repeats: int,
    budget_s: float,
    n_surface: int,
    place: str,
) -> dict:
    """Ask the questions of one kind; return what of a row follows from the answers; ``ready`` as in ``_Queries``."""
    found: dict[int, Mapping[str, float]] = {}
    queries = _Queries(solver, questions, ready)

    def receive(i: int, answer: np.ndarray | Answer) -> None:
        moved = checked(answer, n_surface, place)
        forces = answer.forces if isinstance(answer, Answer) else None
        found[i] = _errors(questions[i], moved, forces)

    timed = time_calls(queries, repeats, budget_s, receive)
    wrong = [i for i, failure in enumerate(timed.failures) if failure]
    row: dict[str, Any] = {"refused": len(queries.refused), "doubted": len(queries.doubted)}
    row["failures"] = len(set(wrong) - queries.refused - queries.doubted)
    row["failure"] = next((timed.failures[i] for i in wrong), "")
    row["memory_mb"] = float(solver.memory_mb)
    answered = sorted(set(found) - set(wrong))
    row["contacts"] = len({tuple(press.node for press in questions[i].load.presses) for i in answered})
    errors = pd.DataFrame([found[i] for i in answered], columns=MEANS, dtype=float)
    row |= errors.mean().to_dict()
    row |= {f"{name}_most": errors[name].max() for name in MOST}
    if seconds := [s for calls in timed.seconds for s in calls]:
        row |= {"online_median_s": np.median(seconds), "online_p95_s": np.percentile(seconds, 95)}
        row["preparation_s"] = float(np.median(queries.prepared)) if queries.prepared else 0.0
    return row


def _errors(question: Question, moved: np.ndarray, forces: np.ndarray | None) -> Mapping[str, float]:
    """Measure one answer; the force's error is of a disc that was pushed to a depth, over the force there."""
    error = truth_errors(moved, question.truth, question.patch)._asdict()
    if forces is None or all(press.moved is None for press in question.load.presses):
        return error | {"force_error": np.nan}
    return error | {"force_error": float(np.linalg.norm(forces - question.forces) / np.linalg.norm(question.forces))}


class _Queries(Sequence):
    """One query for each question; what comes before it is done when it is looked up, off the clock.

    ready : by the nodes that are pressed at once, seconds a press that preparing them took; questions of another kind
        that came before have prepared some
    refused : those that the model does not answer; doubted : those whose answer it does not believe
    prepared : what ``ready`` says of each question's nodes, once
    """

    def __init__(self, solver: Solver, questions: Sequence[Question], ready: dict[tuple[int, ...], float]):
        self._solver, self._questions, self._ready = solver, questions, ready
        self._counted: set[tuple[int, ...]] = set()
        self.refused: set[int] = set()
        self.doubted: set[int] = set()
        self.prepared: list[float] = []

    def __len__(self) -> int:
        return len(self._questions)

    def __getitem__(self, i: Any) -> Any:  # a slice has no meaning here
        load = self._questions[i].load
        try:
            self._prepare(load)
            if precede := getattr(self._solver, "precede", None):
                precede(load)
        except (NotConverged, InputError) as failure:
            return partial(self._fail, i, failure)
        return partial(self._respond, i, load)

    def _prepare(self, load: Load) -> None:
        prepare: Callable[..., object] | None = getattr(self._solver, "prepare_contact", None)
        nodes = tuple(press.node for press in load.presses)
        if prepare is None or nodes in self._counted:
            return
        if nodes not in self._ready:
            start = perf_counter()
            prepare(*nodes)
            counted: Callable[..., float] | None = getattr(self._solver, "seconds_of", None)
            seconds = counted(*nodes) if counted else perf_counter() - start  # what settings share, the first has made
            self._ready[nodes] = seconds / len(nodes)
        self._counted.add(nodes)
        self.prepared.append(self._ready[nodes])

    def _respond(self, i: int, load: Load) -> np.ndarray | Answer:
        try:
            return self._solver.respond(load)
        except Doubted:
            self.doubted.add(i)
            raise
        except (Refused, InputError) as failure:
            return self._fail(i, failure)

    def _fail(self, i: int, failure: NotConverged | InputError) -> np.ndarray:
        """Raise the failure as one that is counted: a contact that is not prepared is refused, too."""
        if isinstance(failure, Refused | InputError):
            self.refused.add(i)
        raise failure if isinstance(failure, NotConverged) else Refused(str(failure))
