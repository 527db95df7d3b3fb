"""Prepare models, ask them, time them and judge their answers: one loop for every kind of question.

A kind of question is a class beneath ``Kind``: what it asks, what is right, and which columns it has of its own. The
columns that all kinds have are here.
"""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.load import Doubted, Refused
from palpate.benchmark.model import Case, LeftOut, Model, checked
from palpate.benchmark.timing import WARM_UP, Call, online, said, time_calls
from palpate.errors import InputError, NotConverged

Row = dict[str, Any]
WHO = ("model", "setting")
KIND = ("sees", "prepared", "law")
"""What a model is told, whether it was prepared for what is asked, and the law of its material."""
COSTS = ("online_median_s", "online_p95_s", "online_max_s", "offline_s", "memory_mb", "threads")
CALLS, REASON = "calls_s", "reason"
"""What rows of questions have beside columns: the seconds of every timed call, and of which kind a failure is."""
REFUSED, DOUBTED, FAILED = "refused", "doubted", "failed"


class Prepared(NamedTuple):
    """What answers for a setting of a model, or why it cannot be prepared.

    about : the columns that say which setting it is
    seconds : what preparing has taken; used : what was used beside, with its cost [s], which grows with queries
    """

    about: Row
    solver: Any
    seconds: float
    used: Mapping[str, float] = {}


def prepared(about: Row, make: Callable[[], Any], used: Mapping[str, float] | None = None) -> Prepared:
    """Make what answers; a NotConverged is kept in its place."""
    begin = perf_counter()
    try:
        solver = make()
    except NotConverged as failure:
        solver = failure
    return Prepared(about, solver, perf_counter() - begin, {} if used is None else used)


def about_of(name: str, model: Model, case: Case) -> Row:
    """Return the columns that say which setting of a model it is, and what that is told."""
    told = {"sees": model.sees, "prepared": model.needs_contacts, "law": model.law_of(case)}
    return {"model": name, "setting": model.text} | told


def prepared_settings(
    case: Case, name: str, models: Sequence[Model], pattern: str = "", progress: Callable = iter
) -> Iterator[Prepared]:
    """Prepare, one after another, those of ``models`` in whose text the regular expression ``pattern`` is found.

    InputError for a setting given twice. Trap: ``used`` is that of the model until the next is prepared.
    """
    texts = [model.text for model in models]
    if twice := [text for text in texts if texts.count(text) > 1]:
        raise InputError(f"{name} is tried with {twice[0]} twice; give each setting once in its tried.")
    charged = replace(case, used={})
    for model in progress([model for model in models if re.search(pattern, model.text)]):
        charged.used.clear()
        yield prepared(about_of(name, model, case), partial(model.prepare, charged), charged.used)


class Kind:
    """Questions of one kind, numbered from 0 on, and how answers are judged.

    labels : columns of every row, such as the scene
    named : of each question what names it, the columns ``question``; n_surface : of the displacements (n_surface, 3)
        [m] that answers have, None if they have others; place : what the InputError for one of a wrong shape names
    question, more : columns of rows of questions, those that name them and further ones
    errors : columns of the errors of an answer; settings have their means, of those in ``largest`` their largest
    spread : errors whose median and 95th percentile settings have too, of their size
    own : further columns of settings
    sums_failed : whether sums run over failed questions too, as zeros, on which the last digit depends
    warm_up : how many calls are made before those that are timed
    """

    question: ClassVar[tuple[str, ...]] = ()
    more: ClassVar[tuple[str, ...]] = ()
    errors: ClassVar[tuple[str, ...]] = ()
    largest: ClassVar[tuple[str, ...]] = ()
    spread: ClassVar[tuple[str, ...]] = ()
    own: ClassVar[tuple[str, ...]] = ()
    sums_failed: ClassVar[bool] = False
    warm_up: ClassVar[int] = WARM_UP

    def __init__(self, labels: Row, named: list[Row], n_surface: int | None = None, place: str = "a model"):
        self.labels, self.named, self.n_surface, self.place = labels, named, n_surface, place

    def rows(self) -> list[Row]:
        """Return a row for each question, before it is asked."""
        return [name | {"failure": "", REASON: ""} for name in self.named]

    def begin(self, solver: Any) -> None:
        """Do what comes before all questions, off the clock; a NotConverged is a failure of each of them."""

    def ready(self, solver: Any, i: int) -> None:
        """Prepare for question ``i``, which is timed apart; where that fails it is not asked."""

    def call(self, solver: Any, i: int) -> Call:
        """Return the call that answers question ``i``; what comes before each is done here, off the clock."""
        raise NotImplementedError

    def judged(self, i: int, answer: Any) -> Row:
        """Return the errors of the first answer to question ``i`` that is timed."""
        return {}

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Ask what is not timed: return columns of the setting, and rows of questions that are no part of means."""
        return {}, []

    @classmethod
    def means(cls, rows: list[Row]) -> Row:
        """Count failures, and average the errors and times of what was answered."""
        failures = [row["failure"] for row in rows if row["failure"]]
        summed = [row for row in rows if cls.sums_failed or not row["failure"]]
        table = pd.DataFrame(summed, columns=list(cls.errors), dtype=float)
        found: Row = {"samples": len(rows), "failures": len(failures), "failure": "".join(failures[:1]), "threads": 1}
        found |= table.mean().to_dict() | {name: table[name].max() for name in cls.largest}
        for name in cls.spread:
            size = table[name].abs()
            found |= {f"{name}_median": size.median(), f"{name}_p95": size.quantile(0.95)}
        return found | online([row.get(CALLS, ()) for row in rows])

    @classmethod
    def columns_of_questions(cls, labels: Iterable[str]) -> list[str]:
        """Return the columns of rows of questions."""
        return [*labels, *WHO, *cls.question, *cls.errors, *cls.more, "seconds", "failure"]

    @classmethod
    def columns_of_settings(cls, labels: Iterable[str]) -> list[str]:
        """Return the columns of rows of settings."""
        spread = (f"{name}_{part}" for name in cls.spread for part in ("median", "p95"))
        return [*labels, *WHO, *KIND, *cls.own, "samples", "failures", *cls.errors, *spread, *COSTS, "failure"]


def measure(kind: Kind, settings: Iterable[Prepared], repeats: int, budget_s: float) -> tuple[list[Row], list[Row]]:
    """Ask every one of ``settings`` all questions: a row a question, and a row a setting, which may have more columns.

    repeats, budget_s : as of ``time_calls``
    On one BLAS thread. A setting that cannot be prepared has failed on every question. One of a model that does not
    know such a body has no rows; a warning says why.
    """
    from threadpoolctl import threadpool_limits

    questions: list[Row] = []
    found: list[Row] = []
    with threadpool_limits(limits=1):
        for one in settings:
            if isinstance(one.solver, LeftOut):
                warnings.warn(f"{one.about['model']} is left out: {one.solver}.", stacklevel=2)
                continue
            rows = ask(kind, one.solver, repeats, budget_s)
            offline_s = one.seconds + sum(one.used.values())
            costs = {"offline_s": offline_s, "memory_mb": float(getattr(one.solver, "memory_mb", 0.0))}
            more, rest = kind.further(one, rows)
            questions += [kind.labels | one.about | row for row in (*rows, *rest)]
            found.append(kind.labels | one.about | costs | kind.means(rows) | more)
    return questions, found


def tables(kind: Kind, questions: list[Row], settings: list[Row]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return both tables of rows; what a row has no value of is empty."""
    of_questions, of_settings = kind.columns_of_questions(kind.labels), kind.columns_of_settings(kind.labels)
    return pd.DataFrame(questions, columns=of_questions), pd.DataFrame(settings, columns=of_settings)


def ask(kind: Kind, solver: Any, repeats: int, budget_s: float) -> list[Row]:
    """Ask each question once, and again in turn while there is time: a row each.

    solver : what was prepared, or the exception why it was not
    """
    rows = kind.rows()
    try:
        if isinstance(solver, Exception):
            raise solver
        kind.begin(solver)
    except NotConverged as failure:
        return [row | failed(failure) for row in rows]
    asked = []
    for i, row in enumerate(rows):
        begin = perf_counter()
        try:
            kind.ready(solver, i)
        except NotConverged as failure:
            row |= failed(failure)
        else:
            asked.append(i)
        row["preparation_s"] = perf_counter() - begin
    found: dict[int, Row] = {}

    def receive(k: int, answer: Any) -> None:
        if kind.n_surface is not None:
            checked(answer, kind.n_surface, kind.place)
        if k not in found:
            found[k] = kind.judged(asked[k], answer)

    if asked:
        timed = time_calls(_Calls(kind, solver, asked), repeats, budget_s, receive, kind.warm_up)
        for k, why in enumerate(timed.failures):
            rows[asked[k]] |= failed(why) if why else found[k] | spent(timed.seconds[k])
    return rows


class _Calls(Sequence):
    """The calls of the questions ``asked``, each looked up anew."""

    def __init__(self, kind: Kind, solver: Any, asked: list[int]):
        self._kind, self._solver, self._asked = kind, solver, asked

    def __len__(self) -> int:
        return len(self._asked)

    def __getitem__(self, k: Any) -> Any:  # a slice has no meaning here
        return self._kind.call(self._solver, self._asked[k])


def spent(seconds: Sequence[float]) -> Row:
    """Return what a row of a question has of the seconds of its calls."""
    return {"seconds": float(np.median(seconds)), CALLS: seconds}


def failed(failure: Exception) -> Row:
    """Return what a row of a question has of a failure."""
    reason = REFUSED if isinstance(failure, Refused) else DOUBTED if isinstance(failure, Doubted) else FAILED
    return {"failure": said(failure), REASON: reason}
