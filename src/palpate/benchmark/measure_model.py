"""Measure one model on one case: its error against the truth, and what it costs before and at run time."""

import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.findings import Asked, Finding, found_rows, labels_of
from palpate.benchmark.judge import Judge
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Model, Setting, Solver, checked, setting_text
from palpate.benchmark.timing import time_calls
from palpate.errors import InputError, NotConverged


def measure(
    case: Case,
    name: str,
    model: Model,
    judge: Judge,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
    more_of: str | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure all settings of ``model`` on the samples of ``judge``: rows of both tables.

    ``repeats`` and ``budget_s`` are those of ``ask``; ``progress`` wraps the sequence of settings, as ``tqdm`` does.
    more_of : a regular expression; a setting in whose name it is found is asked for ``judge.more`` too, unless it has
        learnt from training samples. This is not timed and no part of means: bounds of its errors know more contacts.
    On one BLAS thread. A setting that cannot be prepared has failed on every sample. InputError for one given twice.
    """
    from threadpoolctl import threadpool_limits

    findings, settings = [], model.settings(case)
    texts = [setting_text(setting) for setting in settings]
    if twice := [text for text in texts if texts.count(text) > 1]:
        raise InputError(f"{name}.settings gives {twice[0]} twice; give each setting once.")
    kind = {"sees": model.sees, "law": model.law_of(case)}
    with threadpool_limits(limits=1):
        for setting, text in zip(progress(settings), texts, strict=True):
            fresh = replace(case, used={})
            start = perf_counter()
            solver = _prepared(model, fresh, setting)
            offline = perf_counter() - start
            more = None
            if isinstance(solver, NotConverged):
                asked, memory = Asked.failed(solver, len(judge.numbers)), 0.0
            else:
                given = model.place, model.reduces != ""
                asked = ask(solver, judge, repeats, budget_s, *given)
                memory = float(solver.memory_mb)
            offline += sum(fresh.used.values())  # with the contacts that were prepared when they were asked for
            if not isinstance(solver, NotConverged) and judge.more and _asks_more(more_of, text, fresh):
                more = ask(solver, judge.more, 0, 0.0, *given)
            told = kind | {"prepared": model.needs_contacts(setting)}
            findings.append(Finding(labels_of(case, name, text), asked, offline, memory, told, more))
    return found_rows(findings, judge)


def _asks_more(pattern: str | None, text: str, case: Case) -> bool:
    """Return whether a setting has learnt nothing of training contacts, and is to be asked there too."""
    return "training" not in case.used and pattern is not None and re.search(pattern, text) is not None


def ask(
    solver: Solver, judge: Judge, repeats: int, budget_s: float, place: str = "a model", reduces: bool = False
) -> Asked:
    """Ask for every sample of ``judge`` once, and again in turn while there is time, as ``time_calls`` says.

    Answers are checked off the clock; ``place`` is what the InputError for one of a wrong shape names.
    reduces : whether the solver reduces the fine operator, and its distance from that is measured too
    """
    count = len(judge.numbers)
    found: list[TruthErrors | None] = [None] * count
    operator, estimated = [np.nan] * count, [np.nan] * count
    coarser = [(np.nan, np.nan)] * count

    def receive(i: int, answer: np.ndarray | Answer) -> None:
        moved = checked(answer, judge.truth.shape[1], place)
        if found[i] is None:
            found[i] = judge.errors(i, moved)
            operator[i] = judge.operator_error(i, moved) if reduces else np.nan
            coarser[i] = judge.from_coarser(i, moved)
            if isinstance(answer, Answer) and answer.error is not None:
                estimated[i] = answer.error

    timed = time_calls(_Queries(solver, judge), repeats, budget_s, receive)
    for i, failure in enumerate(timed.failures):
        if failure:
            found[i], operator[i] = None, np.nan
    return Asked(found, operator, timed.failures, timed.seconds, estimated, coarser)


class _Queries(Sequence):
    """One query for each sample; looked up, it has a copy of the load for the solver, which may prepare for it."""

    def __init__(self, solver: Solver, judge: Judge):
        self._solver, self._samples = solver, judge.samples
        self._precede: Callable[[Load], object] | None = getattr(solver, "precede", None)

    def __len__(self) -> int:
        return len(self._samples.contact)

    def __getitem__(self, i: Any) -> Any:  # a slice has no meaning here
        load = Load.at(self._samples.contact[i], self._samples.force[i].copy())
        if self._precede:
            try:
                self._precede(load)
            except NotConverged as failure:
                return partial(_raise, failure)
        return partial(self._solver.respond, load)


def _raise(failure: NotConverged) -> None:
    raise failure


def _prepared(model: Model, case: Case, setting: Setting) -> Solver | NotConverged:
    try:
        return model.prepare(case, setting)
    except NotConverged as failure:
        return failure


def warn_unanswered(name: str, settings: pd.DataFrame) -> None:
    """Warn if one's own model has answered no sample with any setting; ``settings`` as ``measure`` returns them."""
    if (settings["failures"] == settings["samples"]).all():
        warnings.warn(f"tradeoff.own_models.{name} answered no sample: {settings['failure'].iloc[0]}", stacklevel=2)
