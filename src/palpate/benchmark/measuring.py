"""Prepare models, ask them, time them by the same rules and judge their answers: one loop for every kind of question.

A kind of question is a class beneath ``Kind``: what it asks, what is right, and which columns it has of its own. The
columns that all kinds have are here.
"""

import re
import time
import timeit
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.load import Doubted, Refused
from palpate.benchmark.model import Case, LeftOut, Model, checked
from palpate.errors import InputError, NotConverged
from palpate.table_declaration import Table

Row = dict[str, Any]
WHO = ("model", "setting")
CALLS, REASON = "calls_s", "reason"
"""Keys of rows that are no columns: the seconds of every timed call of a question, and the kind of its failure."""
REFUSED, DOUBTED, FAILED = "refused", "doubted", "failed"
WARM_UP = 2
"""Calls that are dropped, as what they compile or load is not a part of a query. Their number is fixed: shape matching
starts from where its last answer ended, so that the rounding of an answer depends on the calls before it."""
SLOW_S, SLOW_CALLS = 1.0, 5
"""Calls that take longer are repeated so often only."""

Call = Callable[[], object]


class Prepared(NamedTuple):
    """A prepared setting of a model.

    about : its columns, such as "model" and "setting"
    solver : what answers questions, or the exception why there is none
    seconds : time of its preparation [s]
    used : times [s] of samples and responses that it uses, by what they are; queries may add to it
    """

    about: Row
    solver: Any
    seconds: float
    used: Mapping[str, float] = {}


def prepared(about: Row, make: Callable[[], Any], used: Mapping[str, float] | None = None) -> Prepared:
    """Call ``make`` for what answers, and time it; a NotConverged that it raises takes the place of what answers."""
    begin = time.perf_counter()
    try:
        solver = make()
    except NotConverged as failure:
        solver = failure
    return Prepared(about, solver, time.perf_counter() - begin, {} if used is None else used)


def about_of(name: str, model: Model, case: Case) -> Row:
    """Return the columns of a model called ``name``: its setting, what it sees, whether contacts are prepared, law."""
    kind = {"sees": model.sees, "prepared": model.needs_contacts, "law": model.law_of(case)}
    return {"model": name, "setting": model.text} | kind


def prepared_settings(
    case: Case, name: str, models: Sequence[Model], pattern: str = "", progress: Callable = iter
) -> Iterator[Prepared]:
    """Prepare, one after another, those of ``models`` in whose text the regular expression ``pattern`` is found.

    name : of the kind of model
    InputError for a setting given twice. Trap: all that is yielded shares one dict ``used``, what the model took from
    the case, which is cleared for the next model: copy it to keep it.
    """
    texts = [model.text for model in models]
    if twice := [text for text in texts if texts.count(text) > 1]:
        raise InputError(f"{name} is tried with {twice[0]} twice; give each setting once in its tried.")
    charged_case = replace(case, used={})  # notes what a model takes, apart from the caller's case
    for model in progress([model for model in models if re.search(pattern, model.text)]):
        charged_case.used.clear()
        yield prepared(about_of(name, model, case), partial(model.prepare, charged_case), charged_case.used)


class Kind:
    """Questions of one kind, numbered from 0 on, and how answers to them are judged.

    labels : columns that all rows have, such as the scene
    named : for each question the columns ``question``, which name it
    n_surface : of the displacements (n_surface, 3) [m] that are answered, None where answers have another form
    place : what the InputError for an answer of another shape names
    question, more : columns of rows of questions, those that name them and further ones
    errors : columns of the errors of an answer; rows of settings have their means, of those in ``largest`` the largest
    spread : errors of whose size rows of settings have the median and the 95th percentile, too
    table : declares the columns of rows of settings
    sums_failed : whether sums run over failed questions too, as zeros, on which the last digit depends
    warm_up : how many calls are made before those that are timed
    """

    question: ClassVar[tuple[str, ...]] = ()
    more: ClassVar[tuple[str, ...]] = ()
    errors: ClassVar[tuple[str, ...]] = ()
    largest: ClassVar[tuple[str, ...]] = ()
    spread: ClassVar[tuple[str, ...]] = ()
    table: ClassVar[Table]
    sums_failed: ClassVar[bool] = False
    warm_up: ClassVar[int] = WARM_UP

    def __init__(self, labels: Row, named: list[Row], n_surface: int | None = None, place: str = "a model"):
        self.labels, self.named, self.n_surface, self.place = labels, named, n_surface, place

    def rows(self) -> list[Row]:
        """Return a row for each question, before it is asked."""
        return [name | {"failure": "", REASON: ""} for name in self.named]

    def begin(self, solver: Any) -> None:
        """Do what comes before all questions and is not timed; a NotConverged is a failure of each of them."""

    def ready(self, solver: Any, i: int) -> None:
        """Prepare ``solver`` for question ``i``, which is timed apart; a NotConverged is a failure of that question."""

    def call(self, solver: Any, i: int) -> Call:
        """Return the call that answers question ``i`` and is timed; what comes before it is done here, untimed."""
        raise NotImplementedError

    def judged(self, i: int, answer: Any) -> Row:
        """Return the errors of the first answer to question ``i`` that is timed."""
        return {}

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Ask what is not timed: return further columns of a setting, and rows of questions that no mean includes.

        one, rows : a prepared setting of a model, and its rows of questions
        """
        return {}, []

    @classmethod
    def means(cls, rows: list[Row]) -> Row:
        """Return the columns of a setting from its rows of questions: failures, means of errors, times of answers."""
        failures = [row["failure"] for row in rows if row["failure"]]
        summed = [row for row in rows if cls.sums_failed or not row["failure"]]
        table = pd.DataFrame(summed, columns=list(cls.errors), dtype=float)
        columns: Row = {"samples": len(rows), "failures": len(failures), "failure": "".join(failures[:1]), "threads": 1}
        columns |= table.mean().to_dict() | {name: table[name].max() for name in cls.largest}
        for name in cls.spread:
            size = table[name].abs()
            columns |= {f"{name}_median": size.median(), f"{name}_p95": size.quantile(0.95)}
        return columns | online([row.get(CALLS, ()) for row in rows])

    @classmethod
    def columns_of_questions(cls, labels: Iterable[str]) -> list[str]:
        """Return the columns of rows of questions."""
        return [*labels, *WHO, *cls.question, *cls.errors, *cls.more, "seconds", "failure"]


def measure(kind: Kind, settings: Iterable[Prepared], repeats: int, budget_s: float) -> tuple[list[Row], list[Row]]:
    """Ask every one of ``settings`` all questions; return a row a question and setting, and a row a setting.

    repeats, budget_s : as of ``time_calls``
    On one BLAS thread. A setting that cannot be prepared has failed on every question. A model that does not know such
    a body is left out, with a warning.
    """
    from threadpoolctl import threadpool_limits

    questions: list[Row] = []
    of_settings: list[Row] = []
    with threadpool_limits(limits=1):
        for setting in settings:
            if isinstance(setting.solver, LeftOut):
                warnings.warn(f"{setting.about['model']} is left out: {setting.solver}.", stacklevel=2)
                continue
            rows = ask(kind, setting.solver, repeats, budget_s)
            offline_s = setting.seconds + sum(setting.used.values())
            costs = {"offline_s": offline_s, "memory_mb": float(getattr(setting.solver, "memory_mb", 0.0))}
            more_columns, more_rows = kind.further(setting, rows)
            questions += [kind.labels | setting.about | row for row in (*rows, *more_rows)]
            of_settings.append(kind.labels | setting.about | costs | kind.means(rows) | more_columns)
    return questions, of_settings


def tables(kind: Kind, questions: list[Row], settings: list[Row]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return both tables of rows; what a row has no value of is empty."""
    return pd.DataFrame(questions, columns=kind.columns_of_questions(kind.labels)), kind.table.frame(settings)


def ask(kind: Kind, solver: Any, repeats: int, budget_s: float) -> list[Row]:
    """Ask a prepared ``solver`` each question once, and again in turn while there is time; return a row a question.

    solver : may be an exception, with which all questions have failed
    """
    rows = kind.rows()
    try:
        if isinstance(solver, Exception):
            raise solver
        kind.begin(solver)
    except NotConverged as failure:
        return [row | failed(failure) for row in rows]
    answered = []
    for i, row in enumerate(rows):
        began = time.perf_counter()
        try:
            kind.ready(solver, i)
        except NotConverged as failure:
            row |= failed(failure)
        else:
            answered.append(i)
        row["preparation_s"] = time.perf_counter() - began
    judged_rows: dict[int, Row] = {}

    def receive(number: int, answer: Any) -> None:
        if kind.n_surface is not None:
            checked(answer, kind.n_surface, kind.place)
        if number not in judged_rows:
            judged_rows[number] = kind.judged(answered[number], answer)

    if answered:
        timed = time_calls(_Calls(kind, solver, answered), repeats, budget_s, receive, kind.warm_up)
        for number, why in enumerate(timed.failures):
            rows[answered[number]] |= failed(why) if why else judged_rows[number] | spent(timed.seconds[number])
    return rows


class _Calls(Sequence):
    """The calls of the questions ``asked``, each looked up anew."""

    def __init__(self, kind: Kind, solver: Any, questions: list[int]):
        self._kind, self._solver, self._asked = kind, solver, questions

    def __len__(self) -> int:
        return len(self._asked)

    def __getitem__(self, k: Any) -> Any:  # a slice has no meaning here
        return self._kind.call(self._solver, self._asked[k])


def spent(seconds: Sequence[float]) -> Row:
    """Return the columns of a row of a question that was answered, from the seconds of its calls."""
    return {"seconds": float(np.median(seconds)), CALLS: seconds}


def failed(failure: Exception) -> Row:
    """Return the columns of a row of a question that failed."""
    reason = REFUSED if isinstance(failure, Refused) else DOUBTED if isinstance(failure, Doubted) else FAILED
    return {"failure": said(failure), REASON: reason}


class Timed(NamedTuple):
    """The seconds of every timed call of each of n calls, and why each failed.

    failures : (n,) the NotConverged that a call raised, else None; a call that failed has no seconds
    """

    seconds: list[list[float]]
    failures: list[NotConverged | None]


def time_calls(
    calls: Sequence[Call],
    repeats: int,
    budget_s: float = np.inf,
    receive: Callable[[int, Any], None] = lambda i, answer: None,
    warm_up: int = WARM_UP,
) -> Timed:
    """Time every one of ``calls`` once, and all in turn until ``repeats`` calls are made or ``budget_s`` [s] is over.

    calls : each is looked up anew before it is made, which is not timed
    receive : takes the number and the answer of every call, which is not timed
    warm_up : number of calls that are dropped before; where the first is slower than SLOW_S, each call is made once,
        and all together SLOW_CALLS times at most
    All run on one BLAS thread. A call for which it or ``receive`` raises NotConverged has failed and is not repeated.
    """
    from threadpoolctl import threadpool_limits

    count = len(calls)
    timed = Timed([[] for _ in range(count)], [None] * count)
    with threadpool_limits(limits=1):
        warm_up_s = [_once(calls, i % count, lambda i, answer: None)[0] for i in range(warm_up)]
        max_calls = min(repeats, SLOW_CALLS) if warm_up_s and warm_up_s[0] > SLOW_S else repeats
        calls_made, began = 0, time.perf_counter()
        while calls_made < count or (calls_made < max_calls and time.perf_counter() - began < budget_s):
            i = calls_made % count
            calls_made += 1
            if timed.failures[i]:
                continue
            seconds, timed.failures[i] = _once(calls, i, receive)
            if timed.failures[i]:
                timed.seconds[i].clear()
            else:
                timed.seconds[i].append(seconds)
    return timed


def _once(calls: Sequence[Call], i: int, receive: Callable[[int, Any], None]) -> tuple[float, NotConverged | None]:
    """Return the seconds that call ``i`` takes, and the NotConverged that it or ``receive`` raises, or None."""
    start = time.perf_counter()
    try:
        call = calls[i]
        start = time.perf_counter()
        answer = call()
        seconds = time.perf_counter() - start
        receive(i, answer)
    except NotConverged as failure:
        return time.perf_counter() - start, failure
    return seconds, None


def said(failure: Exception) -> str:
    """Return the message of a failure in one line, which is never empty."""
    return str(failure).replace("\n", " ") or "not converged"


def online(seconds: Sequence[Sequence[float]], name: str = "online") -> dict[str, float]:
    """Return median, 95th percentile and maximum of times as columns ``<name>_median_s`` …; none without times.

    seconds : of the calls of each question [s]; the maximum is that of the questions' medians
    """
    timed = [each for each in seconds if len(each)]
    if not timed:
        return {}
    calls = np.concatenate(timed)
    # a single late call is the machine's, a press that is late every time the model's
    largest = max(np.median(each) for each in timed)
    return {f"{name}_median_s": np.median(calls), f"{name}_p95_s": np.percentile(calls, 95), f"{name}_max_s": largest}


def processor_seconds(call: Call, least_s: float) -> float:
    """Return the mean processor time of this thread [s] for a call, over as many calls as take about ``least_s``."""
    timer = timeit.Timer(call, timer=time.thread_time)
    number = max(1, int(least_s / timer.timeit(number=1)))
    return timer.timeit(number=number) / number
