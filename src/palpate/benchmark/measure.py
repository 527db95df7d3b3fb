"""Tabulate what a model was found to do: a row a sample, and a row a setting.

Measure one model on one case: its error against the truth, and what it costs before and at run time.

Tabulate what no model can be better or should be worse than: the truth's own error, and the answer zero.
"""

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.comparison import OWN_ERROR, TRUTH, ZERO
from palpate.benchmark.judge import SIDES, Judge
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Model, Setting, Solver, checked, setting_text
from palpate.benchmark.timing import said, time_calls
from palpate.errors import InputError, NotConverged

ERRORS = list(TruthErrors._fields)
SPREAD = ["rmse_of_peak", "relative_l2", "patch_rms_of_peak", "patch_max_of_peak"]
"""The errors whose median and 95th percentile over the test samples are tabulated beside their means."""
CHOSEN_BY = ["rmse_of_peak", "patch_rms_of_peak"]
"""The errors that settings are chosen by, on validation samples."""
LABELS = ["scene", "body", "regime", "model", "setting"]
KIND = ["sees", "prepared", "law"]
OPERATOR = "operator_rmse_of_peak"
ESTIMATED = "estimated_of_peak"
"""The error that a model estimates of its own answer; empty of models that do not."""
COARSER = {"rms": "coarser_rmse_of_peak", "patch": "coarser_patch_rms_of_peak"}
"""The distance of an answer from that of quadratic elements one level coarser than the finest, by kind of error."""
SAMPLE_COLUMNS = [
    *LABELS, "split", "side", "sample", "contact", *ERRORS, OPERATOR, ESTIMATED, *COARSER.values(), "seconds",
    "failure",
]  # fmt: skip
SETTING_COLUMNS = [
    *LABELS, *KIND, "protocol", "split", "samples", "failures", *ERRORS, OPERATOR,
    *(f"{name}_{part}" for name in SPREAD for part in ("median", "p95")),
    *(f"validation_{name}" for name in CHOSEN_BY),
    "online_median_s", "online_p95_s", "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip


class Asked(NamedTuple):
    """The answers of a solver to each sample.

    errors : of its answers; None where it failed, and ``failures`` has its message, else ""
    operator : distance from the fine operator, as a share of the peak; NaN where that means nothing
    seconds : of every timed call of each sample; of one that failed, none
    estimated : the RMSE over peak that the solver estimates of its answer; None or NaN where it does not
    coarser : distances from the answer of coarser elements, as ``Judge.from_coarser``; None where nobody compared
    """

    errors: list[TruthErrors | None]
    operator: list[float]
    failures: list[str]
    seconds: list[list[float]]
    estimated: list[float] | None = None
    coarser: list[tuple[float, float]] | None = None

    @staticmethod
    def failed(failure: NotConverged, count: int) -> "Asked":
        """Return that none of ``count`` samples was answered."""
        return Asked([None] * count, [np.nan] * count, [said(failure)] * count, [[]] * count)


class Finding(NamedTuple):
    """The result of one setting; ``labels`` are the columns LABELS, ``kind`` those of KIND.

    more : the answers to ``judge.more``, which are rows of samples and no part of means
    """

    labels: dict[str, str]
    asked: Asked
    offline_s: float
    memory_mb: float
    kind: Mapping[str, str | bool]
    more: Asked | None = None


def labels_of(case: Case, model: str, setting: str) -> dict[str, str]:
    """Return the columns LABELS."""
    scene = f"{case.body.name}_{case.regime}"
    return {"scene": scene, "body": case.body.name, "regime": case.regime, "model": model, "setting": setting}


def found_rows(findings: list[Finding], judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a row a sample and a row a setting; cells of errors and seconds are empty where nothing was answered."""
    samples: list[dict] = []
    for finding in findings:
        samples += _sample_rows(finding.labels, finding.asked, judge)
        if finding.more and judge.more:
            samples += _sample_rows(finding.labels, finding.more, judge.more)
    settings = [_setting_row(finding, judge) for finding in findings]
    return pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings, columns=SETTING_COLUMNS)


def _sample_rows(labels: dict[str, str], asked: Asked, judge: Judge) -> list[dict]:
    rows = []
    for i, found in enumerate(asked.errors):
        row = {**labels, "split": judge.split, "side": judge.side[i], "sample": judge.numbers[i]}
        row |= {"contact": judge.samples.contact[i], "failure": asked.failures[i]}
        if found is not None:
            seconds = np.median(asked.seconds[i]) if asked.seconds[i] else np.nan
            row |= found._asdict() | {OPERATOR: asked.operator[i], "seconds": seconds}
            row |= {ESTIMATED: asked.estimated[i] if asked.estimated else np.nan}
            if asked.coarser:
                row |= dict(zip(COARSER.values(), asked.coarser[i], strict=True))
        rows.append(row)
    return rows


def _setting_row(finding: Finding, judge: Judge) -> dict:
    """Take means over the test samples that were answered, but the largest max_of_peak of any.

    Errors on validation samples are empty unless all of them were answered.
    """
    asked = finding.asked
    answers = pd.DataFrame([f if f is not None else [np.nan] * len(ERRORS) for f in asked.errors], columns=ERRORS)
    answers[OPERATOR] = asked.operator
    chooses, tests = (judge.side == side for side in SIDES)
    failures = np.array(asked.failures, dtype=object)
    row: dict[str, Any] = {**finding.labels, **finding.kind, "protocol": "live", "split": judge.split, "threads": 1}
    row |= {"samples": int(tests.sum()), "failures": int((failures[tests] != "").sum())}
    row |= {"failure": next(filter(None, asked.failures), "")}
    row |= {"offline_s": finding.offline_s, "memory_mb": finding.memory_mb}
    row |= {f"validation_{name}": answers.loc[chooses, name].mean(skipna=False) for name in CHOSEN_BY}
    if seconds := [s for calls in asked.seconds for s in calls]:
        row |= {"online_median_s": np.median(seconds), "online_p95_s": np.percentile(seconds, 95)}
    found = answers[tests]
    row |= found.mean().to_dict() | {"max_of_peak": found["max_of_peak"].max()}
    for name in SPREAD:
        row |= {f"{name}_median": found[name].median(), f"{name}_p95": found[name].quantile(0.95)}
    return row


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


UNPREPARED: dict[str, str | bool] = {"sees": "load", "prepared": False}


def bounds(case: Case, judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the models "truth" and "zero" as ``measure_model.measure`` does: a row a sample, a row a setting.

    The time of the truth is that of its solutions on all levels; the answer zero has none.
    """
    count = len(judge.numbers)
    own: list[TruthErrors | None] = [TruthErrors(*map(float, each)) for each in judge.own]
    nothing: list[TruthErrors | None] = [judge.errors(i, np.zeros_like(truth)) for i, truth in enumerate(judge.truth)]
    taken = [[float(seconds)] for seconds in judge.own_seconds]
    rest = [np.nan] * count, [""] * count
    never: list[list[float]] = [[]] * count
    findings = [
        Finding(labels_of(case, model, setting), Asked(errors, *rest, seconds), 0.0, 0.0, UNPREPARED | {"law": law})
        for model, setting, errors, seconds, law in (
            (TRUTH, OWN_ERROR, own, taken, case.body.material.law),
            (ZERO, "default", nothing, never, ""),
        )
    ]
    return found_rows(findings, judge)
