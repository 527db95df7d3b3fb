"""Measure one model on one case: its error on samples it never saw, and what it costs before and at run time."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.errors import InputError, NotConverged
from palpate.evaluation.accuracy import Errors, errors
from palpate.evaluation.timing import said, time_calls
from palpate.models.model import Case, Model, Setting, Solver, checked, setting_text
from palpate.samples.database import Database

ERRORS = list(Errors._fields)
LABELS = ["scene", "body", "regime", "model", "setting"]
SAMPLE_COLUMNS = [*LABELS, "sample", *ERRORS, "seconds", "failure"]
SETTING_COLUMNS = [
    *LABELS, "protocol", "split", "samples", "failures", *ERRORS,
    "online_median_s", "online_p95_s", "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip


class Asked(NamedTuple):
    """The answers of a solver to each test sample.

    errors : of its answers; None where it failed, and ``failures`` has its message, else ""
    seconds : of every timed call of each sample; of one that failed, none
    """

    errors: list[Errors | None]
    failures: list[str]
    seconds: list[list[float]]

    @staticmethod
    def failed(failure: NotConverged, count: int) -> "Asked":
        """Return that none of ``count`` samples was answered."""
        return Asked([None] * count, [said(failure)] * count, [[]] * count)


class Finding(NamedTuple):
    """The result of one setting; ``labels`` are the columns LABELS."""

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
    """Measure all settings of ``model`` on the samples ``test`` with these ``numbers``: rows of both.

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
                asked, memory = ask(solver, test, repeats, budget_s, model.place), float(solver.memory_mb)
            findings.append(Finding(labels_of(case, name, setting_text(setting)), asked, offline, memory))
    return found_rows(findings, numbers, case.options.split)


def ask(solver: Solver, test: Database, repeats: int, budget_s: float, place: str = "a model") -> Asked:
    """Ask for every sample of ``test`` once, and again in turn while there is time, as ``time_calls`` says.

    Answers are checked off the clock; ``place`` is what the InputError for one of a wrong shape names.
    """
    found: list[Errors | None] = [None] * len(test.contact)

    def receive(i: int, answer: np.ndarray) -> None:
        checked(answer, test.fine.shape[1], place)
        found[i] = found[i] or errors(answer, test.fine[i])

    timed = time_calls(_Queries(solver, test), repeats, budget_s, receive)
    kept = [None if failure else each for each, failure in zip(found, timed.failures, strict=True)]
    return Asked(kept, timed.failures, timed.seconds)


class _Queries(Sequence):
    """One query for each sample of ``test``; looked up, it has a copy of the force for the solver."""

    def __init__(self, solver: Solver, test: Database):
        self._solver, self._test = solver, test

    def __len__(self) -> int:
        return len(self._test.contact)

    def __getitem__(self, i: Any) -> Any:  # a slice has no meaning here
        return partial(self._solver.respond, int(self._test.contact[i]), self._test.force[i].copy())


def _prepared(model: Model, case: Case, setting: Setting) -> Solver | NotConverged:
    try:
        return model.prepare(case, setting)
    except NotConverged as failure:
        return failure


def labels_of(case: Case, model: str, setting: str) -> dict[str, str]:
    """Return the columns LABELS."""
    scene = f"{case.body.name}_{case.regime}"
    return {"scene": scene, "body": case.body.name, "regime": case.regime, "model": model, "setting": setting}


def found_rows(findings: list[Finding], numbers: np.ndarray, split: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a row a sample and a row a setting; cells of errors and seconds are empty where nothing was answered."""
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
    """Take means over the samples that were answered, but the largest max_of_peak of any."""
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


def warn_unanswered(name: str, settings: pd.DataFrame) -> None:
    """Warn if one's own model has answered no sample with any setting; ``settings`` as ``measure`` returns them."""
    if (settings["failures"] == settings["samples"]).all():
        warnings.warn(f"tradeoff.own_models.{name} answered no sample: {settings['failure'].iloc[0]}", stacklevel=2)
