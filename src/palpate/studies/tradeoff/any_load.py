"""Measure models under loads that they were not prepared for: other places, two contacts, discs pushed to a depth."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import truth_errors
from palpate.benchmark.load import Answer
from palpate.benchmark.measure import LABELS, Queries, labels_of, prepared_settings
from palpate.benchmark.model import Case, Model, Solver, checked
from palpate.benchmark.timing import said, time_calls
from palpate.errors import NotConverged
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
    for a press beforehand, as ``Solver.prepare_nodes`` says. On one BLAS thread.
    """
    from threadpoolctl import threadpool_limits

    rows: list[dict] = []
    with threadpool_limits(limits=1):
        for one in prepared_settings(case, model, pattern, progress):
            labels, offline = labels_of(case, name, one.text), one.offline_s
            ready: dict[tuple[int, ...], float] = {}
            for kind in dict.fromkeys(question.kind for question in asked):
                questions = [question for question in asked if question.kind == kind]
                row = {**labels, "kind": kind, "samples": len(questions), "offline_s": offline}
                if isinstance(one.solver, NotConverged):
                    row |= {"refused": 0, "doubted": 0, "failures": len(questions), "contacts": 0}
                    rows.append(row | {"failure": said(one.solver)})
                else:
                    place = case.n_surface, model.place
                    rows.append(row | _asked(one.solver, questions, ready, repeats, budget_s, *place))
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
    """Ask the questions of one kind; return what of a row follows from the answers; ``ready`` as in ``Queries``."""
    found: dict[int, Mapping[str, float]] = {}
    queries = Queries(solver, len(questions), lambda i: questions[i].load, ready)

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
