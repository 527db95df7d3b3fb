"""Prepare a model, ask it, time it and judge its answers: the one place where models are measured."""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.judge import SIDES, Judge
from palpate.benchmark.load import Answer, Doubted, Load, Refused, loads_of
from palpate.benchmark.model import Case, LeftOut, Model, Solver, checked
from palpate.benchmark.ranking import OWN_ERROR, TRUTH, ZERO
from palpate.benchmark.timing import online, said, time_calls
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
    *LABELS, *KIND, "protocol", "split", "samples", "failures", "rejected", "rejected_answered", *ERRORS, OPERATOR,
    *(f"{name}_{part}" for name in SPREAD for part in ("median", "p95")),
    *(f"validation_{name}" for name in CHOSEN_BY),
    "online_median_s", "online_p95_s", "online_max_s", "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip


class Asked(NamedTuple):
    """The answer of a solver to one sample.

    errors : of the answer; None where it failed, and ``failure`` has its message, else ""
    seconds : of every timed call; none if it failed
    operator : distance from the fine operator, as a share of the peak; NaN where that means nothing
    estimated : the RMSE over peak that the solver estimates of its answer; NaN where it does not
    coarser : distances from the answer of coarser elements, as ``Judge.from_coarser``
    """

    errors: TruthErrors | None = None
    seconds: Sequence[float] = ()
    failure: str = ""
    operator: float = np.nan
    estimated: float = np.nan
    coarser: tuple[float, float] = (np.nan, np.nan)


class Finding(NamedTuple):
    """The result of one setting; ``labels`` are the columns LABELS, ``kind`` those of KIND.

    asked : the answer to each sample
    more : the answers to ``judge.training``, which are rows of samples and no part of means
    rejected : of each press whose truth was rejected whether it was answered, without a doubt or a failure
    """

    labels: dict[str, str]
    asked: list[Asked]
    offline_s: float
    memory_mb: float
    kind: Mapping[str, str | bool]
    more: list[Asked] | None = None
    rejected: Sequence[bool] = ()


def labels_of(case: Case, model: str, setting: str) -> dict[str, str]:
    """Return the columns LABELS."""
    scene = f"{case.body.name}_{case.regime}"
    return {"scene": scene, "body": case.body.name, "regime": case.regime, "model": model, "setting": setting}


def found_rows(findings: list[Finding], judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a row a sample and a row a setting; cells of errors and seconds are empty where nothing was answered."""
    samples: list[dict] = []
    for finding in findings:
        samples += _sample_rows(finding.labels, finding.asked, judge)
        if finding.more and judge.training:
            samples += _sample_rows(finding.labels, finding.more, judge.training)
    settings = [_setting_row(finding, judge) for finding in findings]
    return pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings, columns=SETTING_COLUMNS)


def _sample_rows(labels: dict[str, str], asked: list[Asked], judge: Judge) -> list[dict]:
    rows = []
    for i, found in enumerate(asked):
        row = {**labels, "split": judge.split, "side": judge.side[i], "sample": judge.numbers[i]}
        row |= {"contact": judge.samples.contact[i], "failure": found.failure}
        if found.errors is not None:
            seconds = np.median(found.seconds) if found.seconds else np.nan
            row |= found.errors._asdict() | {OPERATOR: found.operator, "seconds": seconds, ESTIMATED: found.estimated}
            row |= dict(zip(COARSER.values(), found.coarser, strict=True))
        rows.append(row)
    return rows


def _setting_row(finding: Finding, judge: Judge) -> dict:
    """Take means over the test samples that were answered, but the largest max_of_peak of any.

    Errors on validation samples are empty unless all of them were answered. The largest time is that of the slowest
    press, the median of its calls.
    """
    asked = finding.asked
    nothing = [np.nan] * len(ERRORS)
    answers = pd.DataFrame([nothing if each.errors is None else each.errors for each in asked], columns=ERRORS)
    answers[OPERATOR] = [each.operator for each in asked]
    chooses, tests = (judge.side == side for side in SIDES)
    failures = np.array([each.failure for each in asked], dtype=object)
    row: dict[str, Any] = {**finding.labels, **finding.kind, "protocol": "live", "split": judge.split, "threads": 1}
    row |= {"samples": int(tests.sum()), "failures": int((failures[tests] != "").sum())}
    row |= {"rejected": len(finding.rejected), "rejected_answered": sum(finding.rejected)}
    row |= {"failure": next(filter(None, failures), "")}
    row |= {"offline_s": finding.offline_s, "memory_mb": finding.memory_mb}
    row |= {f"validation_{name}": answers.loc[chooses, name].mean(skipna=False) for name in CHOSEN_BY}
    row |= online([each.seconds for each in asked])
    found = answers[tests]
    row |= found.mean().to_dict() | {"max_of_peak": found["max_of_peak"].max()}
    for name in SPREAD:
        row |= {f"{name}_median": found[name].median(), f"{name}_p95": found[name].quantile(0.95)}
    return row


def measure(
    case: Case,
    name: str,
    models: Sequence[Model],
    judge: Judge,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
    more_of: str | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure ``models``, which are one with several settings, on the samples of ``judge``: rows of both tables.

    ``repeats`` and ``budget_s`` are those of ``ask``; ``progress`` wraps the sequence of settings, as ``tqdm`` does.
    more_of : a regular expression; a setting in whose name it is found is asked for ``judge.training`` too, unless it
        has learnt from training samples. This is not timed and no part of means: bounds of its errors know more
        contacts.
    Every setting is asked for the presses of ``judge.rejected``, too, off the clock: these have no truth, and a model
    that knows its limits doubts or refuses them.
    On one BLAS thread. A setting that cannot be prepared has failed on every sample. A model that does not know such a
    body has no rows; a warning says why. InputError for a setting given twice.
    """
    from threadpoolctl import threadpool_limits

    findings, texts = [], [model.text for model in models]
    if twice := [text for text in texts if texts.count(text) > 1]:
        raise InputError(f"{name} is tried with {twice[0]} twice; try each setting once.")
    with threadpool_limits(limits=1):
        for one in prepared_settings(case, models, progress=progress):
            model, given = one.model, (one.model.place, one.model.reduces != "")
            more, memory = None, 0.0
            if isinstance(one.solver, LeftOut):
                warnings.warn(f"{name} is left out: {one.solver}.", stacklevel=2)
                return found_rows([], judge)
            if isinstance(one.solver, NotConverged):
                asked, offline = [Asked(failure=said(one.solver))] * len(judge.numbers), one.offline_s
            else:
                asked, memory = ask(one.solver, judge, repeats, budget_s, *given), float(one.solver.memory_mb)
                offline = one.offline_s  # with the contacts that were prepared when they were asked for
                learnt = "training" in one.used
                if judge.training and not learnt and more_of is not None and re.search(more_of, model.text):
                    more = ask(one.solver, judge.training, 0, 0.0, *given)
            about = _kind(model, case)
            answered = _answered(one.solver, judge, asked, model.place)
            findings.append(Finding(labels_of(case, name, model.text), asked, offline, memory, about, more, answered))
    return found_rows(findings, judge)


def failed(case: Case, model: Model, judge: Judge, why: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a model that has failed on every sample because of ``why``, as ``measure`` does."""
    asked = [Asked(failure=why)] * len(judge.numbers)
    labels = labels_of(case, model.name, model.text)
    return found_rows([Finding(labels, asked, np.nan, np.nan, _kind(model, case))], judge)


def _kind(model: Model, case: Case) -> dict[str, str | bool]:
    return {"sees": model.sees, "prepared": model.needs_contacts, "law": model.law_of(case)}


def _answered(solver: Solver | NotConverged, judge: Judge, asked: list[Asked], place: str) -> list[bool]:
    """Return of each press whose truth was rejected whether it is answered without a doubt or a failure.

    Where no press of a side has a truth they are among those ``asked``; the others are asked now. ``place`` as in
    ``ask``.
    """
    found = [each.failure == "" for each, known in zip(asked, judge.believed, strict=True) if not known]
    if judge.rejected is None or isinstance(solver, NotConverged):
        return found + [False] * (0 if judge.rejected is None else len(judge.rejected.contact))
    loads = loads_of(judge.rejected.contact, judge.rejected.force.copy())
    queries = Queries(solver, len(loads), loads.__getitem__)
    for i in range(len(loads)):
        try:
            checked(queries[i](), judge.truth.shape[1], place)
        except NotConverged:
            found.append(False)
        else:
            found.append(True)
    return found


class Prepared(NamedTuple):
    """What answers for a model, or why it cannot be prepared.

    seconds : what preparing has taken; used : what was used beside, with its cost [s], which grows with queries
    """

    model: Model
    solver: Solver | NotConverged
    seconds: float
    used: dict[str, float]

    @property
    def offline_s(self) -> float:
        """The offline time [s] so far."""
        return self.seconds + sum(self.used.values())


def prepared_settings(
    case: Case, models: Sequence[Model], pattern: str = "", progress: Callable = iter
) -> Iterator[Prepared]:
    """Prepare, one after another, those of ``models`` in whose text the regular expression ``pattern`` is found.

    Trap: ``used`` is that of the model until the next is prepared.
    """
    charged = replace(case, used={})
    for model in progress([model for model in models if re.search(pattern, model.text)]):
        charged.used.clear()
        begin = perf_counter()
        try:
            solver: Solver | NotConverged = model.prepare(charged)
        except NotConverged as failure:
            solver = failure
        yield Prepared(model, solver, perf_counter() - begin, charged.used)


def ask(
    solver: Solver, judge: Judge, repeats: int, budget_s: float, place: str = "a model", reduces: bool = False
) -> list[Asked]:
    """Ask for every sample of ``judge`` once, and again in turn while there is time, as ``time_calls`` says.

    Answers are checked off the clock; ``place`` is what the InputError for one of a wrong shape names.
    reduces : whether the solver reduces the fine operator, and its distance from that is measured too
    """
    count = len(judge.numbers)
    found = [Asked()] * count

    def receive(i: int, answer: np.ndarray | Answer) -> None:
        moved = checked(answer, judge.truth.shape[1], place)
        if found[i].errors is None:
            operator = judge.operator_error(i, moved) if reduces else np.nan
            told = answer.error if isinstance(answer, Answer) else None
            estimated = np.nan if told is None else told
            found[i] = Asked(judge.errors(i, moved), (), "", operator, estimated, judge.from_coarser(i, moved))

    def load_of(i: int) -> Load:
        return Load.at(judge.samples.contact[i], judge.samples.force[i].copy())

    timed = time_calls(Queries(solver, count, load_of), repeats, budget_s, receive)
    return [
        Asked(failure=failure) if failure else each._replace(seconds=seconds)
        for each, failure, seconds in zip(found, timed.failures, timed.seconds, strict=True)
    ]


class Queries(Sequence):
    """One query for each of ``count`` loads; what comes before it is done when it is looked up, off the clock.

    ready : by the nodes that are pressed at once, seconds a press that preparing them took, which is added to; or None
        if no preparation is measured apart, and a load that cannot be pressed stops the run
    refused : loads that the model does not answer; doubted : those whose answer it does not believe
    prepared : what ``ready`` says of each load's nodes, once
    """

    def __init__(
        self,
        solver: Solver,
        count: int,
        load_of: Callable[[int], Load],
        ready: dict[tuple[int, ...], float] | None = None,
    ):
        self._solver, self._count, self._load_of, self._ready = solver, count, load_of, ready
        self._counted: set[tuple[int, ...]] = set()
        self.refused: set[int] = set()
        self.doubted: set[int] = set()
        self.prepared: list[float] = []

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, i: Any) -> Any:  # a slice has no meaning here
        load = self._load_of(i)
        try:
            if self._ready is not None:
                self._prepare(load, self._ready)
            self._solver.precede(load)
        except (NotConverged, InputError) as failure:
            return partial(self._fail, i, failure)
        return partial(self._solver.respond, load) if self._ready is None else partial(self._respond, i, load)

    def _prepare(self, load: Load, ready: dict[tuple[int, ...], float]) -> None:
        nodes = tuple(press.node for press in load.presses)
        if nodes in self._counted:
            return
        if nodes not in ready:
            seconds = self._solver.prepare_nodes(nodes)
            if seconds is None:
                return
            ready[nodes] = seconds / len(nodes)
        self._counted.add(nodes)
        self.prepared.append(ready[nodes])

    def _respond(self, i: int, load: Load) -> np.ndarray | Answer:
        try:
            return self._solver.respond(load)
        except Doubted:
            self.doubted.add(i)
            raise
        except (Refused, InputError) as failure:
            return self._fail(i, failure)

    def _fail(self, i: int, failure: NotConverged | InputError) -> np.ndarray:
        """Raise the failure; where preparation is measured, a contact that is not prepared counts as refused."""
        if isinstance(failure, Refused | InputError):
            self.refused.add(i)
        if isinstance(failure, InputError) and self._ready is not None:
            raise Refused(str(failure))
        raise failure


def warn_unanswered(name: str, settings: pd.DataFrame) -> None:
    """Warn if one's own model has answered no sample with any setting; ``settings`` as ``measure`` returns them."""
    if (settings["failures"] == settings["samples"]).all():
        warnings.warn(f"tradeoff.own_models.{name} answered no sample: {settings['failure'].iloc[0]}", stacklevel=2)


def bounds(case: Case, judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the models "truth" and "zero" as ``measure`` does: a row a sample, a row a setting.

    The truth's own errors are those of ``judge.training`` too. The time of the truth is that of its solutions
    on all levels; the answer zero has none.
    """
    still = [Asked(judge.errors(i, np.zeros_like(truth))) for i, truth in enumerate(judge.truth)]
    about: dict[str, str | bool] = {"sees": "load", "prepared": False}
    known, more = about | {"law": case.body.material.law}, _own(judge.training) if judge.training else None
    findings = [
        Finding(labels_of(case, TRUTH, OWN_ERROR), _own(judge), 0.0, 0.0, known, more),
        Finding(labels_of(case, ZERO, "default"), still, 0.0, 0.0, about | {"law": ""}),
    ]
    return found_rows(findings, judge)


def _own(judge: Judge) -> list[Asked]:
    """Return the truth's own errors and what it took."""
    own = zip(judge.own, judge.own_seconds, strict=True)
    return [Asked(TruthErrors(*map(float, errors)), [float(seconds)]) for errors, seconds in own]
