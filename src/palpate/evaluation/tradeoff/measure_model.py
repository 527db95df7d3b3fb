"""One model on one case: how wrong it is on samples it never saw, and what it costs before and at run time."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.errors import InputError, NotConverged
from palpate.evaluation.accuracy import Errors, errors
from palpate.models.model import Case, Model, Setting, Solver, checked, setting_text
from palpate.samples.database import Database

ERRORS = list(Errors._fields)
LABELS = ["scene", "body", "regime", "model", "setting"]
SAMPLE_COLUMNS = [*LABELS, "sample", *ERRORS, "seconds", "failure"]
SETTING_COLUMNS = [
    *LABELS, "protocol", "split", "samples", "failures", *ERRORS,
    "online_median_s", "online_p95_s", "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip
WARM_UP = 2


class Asked(NamedTuple):
    """What a solver did with each test sample.

    errors : of its answers; None where it failed, and ``failures`` has what it said, else ""
    seconds : of every timed call of each sample; of one that failed, none
    """

    errors: list[Errors | None]
    failures: list[str]
    seconds: list[list[float]]

    @staticmethod
    def failed(failure: NotConverged, count: int) -> "Asked":
        """None of ``count`` samples was answered."""
        return Asked([None] * count, [_said(failure)] * count, [[]] * count)


class Finding(NamedTuple):
    """What was found of one setting; ``labels`` are the columns LABELS."""

    labels: dict[str, str]
    asked: Asked
    offline_s: float
    memory_mb: float


def measure(
    case: Case,
    name: str,
    model: Model,
    test: Database,
    numbers: np.ndarray,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure all settings of ``model`` on the samples ``test`` with these ``numbers``: a row a sample, a row a setting.

    ``repeats`` and ``budget_s`` are those of ``ask``; ``progress`` wraps the sequence of settings, as ``tqdm`` does.
    On one BLAS thread. A setting that cannot be prepared has failed on every sample. InputError for one given twice.
    """
    from threadpoolctl import threadpool_limits

    findings, settings = [], model.settings(case)
    texts = [setting_text(setting) for setting in settings]
    if twice := [text for text in texts if texts.count(text) > 1]:
        raise InputError(f"{name}.settings gives {twice[0]} twice; give each setting once.")
    with threadpool_limits(limits=1):
        for setting in progress(settings):
            fresh = replace(case, used={})
            start = perf_counter()
            solver = _prepared(model, fresh, setting)
            offline = perf_counter() - start + sum(fresh.used.values())
            if isinstance(solver, NotConverged):
                asked, memory = Asked.failed(solver, len(numbers)), 0.0
            else:
                asked, memory = ask(solver, test, repeats, budget_s), float(solver.memory_mb)
            findings.append(Finding(labels_of(case, name, setting_text(setting)), asked, offline, memory))
    return found_rows(findings, numbers, case.options.split)


def ask(solver: Solver, test: Database, repeats: int, budget_s: float) -> Asked:
    """Ask for every sample of ``test`` once, and then again in turn until there are ``repeats`` timed calls or
    ``budget_s`` [s] have gone by.

    A few calls beforehand are dropped, as what they compile or load is no part of a query.
    """
    count, n_surface = len(test.contact), test.fine.shape[1]
    queries = [(int(c), f) for c, f in zip(test.contact, test.force, strict=True)]
    found: list[Errors | None] = [None] * count
    failures, seconds = [""] * count, [[] for _ in range(count)]
    for query in queries[:WARM_UP]:
        _answer(solver, query, n_surface)
    began, calls = perf_counter(), 0
    while calls < count or (calls < repeats and perf_counter() - began < budget_s):
        i = calls % count
        calls += 1
        if failures[i]:
            continue
        answer, took = _answer(solver, queries[i], n_surface)
        if isinstance(answer, NotConverged):
            failures[i], seconds[i], found[i] = _said(answer), [], None
            continue
        found[i] = found[i] or errors(answer, test.fine[i])
        seconds[i].append(took)
    return Asked(found, failures, seconds)


def _prepared(model: Model, case: Case, setting: Setting) -> Solver | NotConverged:
    try:
        return model.prepare(case, setting)
    except NotConverged as failure:
        return failure


def _answer(solver: Solver, query: tuple, n_surface: int) -> tuple[np.ndarray | NotConverged, float]:
    """An answer, or why there is none, and how long it took [s]; what is asked is given away as a copy."""
    contact, force = query[0], query[1].copy()
    start = perf_counter()
    try:
        answer = solver.respond(contact, force)
        took = perf_counter() - start
        return checked(answer, n_surface), took
    except NotConverged as failure:
        return failure, perf_counter() - start


def _said(failure: NotConverged) -> str:
    return str(failure).replace("\n", " ") or "not converged"


def labels_of(case: Case, model: str, setting: str) -> dict[str, str]:
    """The columns LABELS."""
    scene = f"{case.body.name}_{case.regime}"
    return {"scene": scene, "body": case.body.name, "regime": case.regime, "model": model, "setting": setting}


def found_rows(findings: list[Finding], numbers: np.ndarray, split: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """One row a sample and one a setting; where nothing was answered, cells of errors and seconds are empty."""
    samples = [row for finding in findings for row in _sample_rows(finding, numbers)]
    settings = [{"split": split} | _setting_row(finding) for finding in findings]
    return pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings, columns=SETTING_COLUMNS)


def _sample_rows(finding: Finding, numbers: np.ndarray) -> list[dict]:
    rows = []
    for number, found, failure, seconds in zip(numbers, *finding.asked, strict=True):
        row = {} if found is None else found._asdict() | {"seconds": np.median(seconds)}
        rows.append({**finding.labels, "sample": number, **row, "failure": failure})
    return rows


def _setting_row(finding: Finding) -> dict:
    """Means over the samples that were answered, but the largest max_of_peak of any."""
    asked = finding.asked
    row = finding.labels | {"protocol": "live", "samples": len(asked.failures), "threads": 1}
    row |= {"failures": sum(map(bool, asked.failures)), "failure": next(filter(None, asked.failures), "")}
    row |= {"offline_s": finding.offline_s, "memory_mb": finding.memory_mb}
    found = pd.DataFrame([f for f in asked.errors if f is not None], columns=ERRORS)
    if found.empty:
        return row
    seconds = [s for calls in asked.seconds for s in calls]
    row |= {"online_median_s": np.median(seconds), "online_p95_s": np.percentile(seconds, 95)}
    return row | found.mean().to_dict() | {"max_of_peak": found["max_of_peak"].max()}
