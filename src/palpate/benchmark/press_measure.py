"""Measure models on presses: what is asked, the errors of an answer, and the rows of both tables."""

import re
import warnings
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pandas as pd

from palpate.benchmark import measuring
from palpate.benchmark.accuracy import Judge, TruthErrors
from palpate.benchmark.load import Answer, Load, displacement_of, loads_of
from palpate.benchmark.measuring import Call, Kind, Prepared, Row, about_of, ask, prepared_settings, spent, tables
from palpate.benchmark.model import Case, Model, Solver, checked
from palpate.benchmark.ranking import OWN_ERROR, SIDES, TRUTH, ZERO
from palpate.errors import NotConverged
from palpate.table_declaration import Table

ERRORS = TruthErrors._fields
CHOSEN_BY = ("rmse_of_peak", "patch_rms_of_peak")
"""The errors that settings are chosen by, on validation samples."""
OPERATOR = "operator_rmse_of_peak"
"""The distance from the fine operator's answer, of models that reduce it."""
ESTIMATED = "estimated_of_peak"
"""The error that a model estimates of its own answer; empty of models that do not."""
COARSER = {"rms": "coarser_rmse_of_peak", "patch": "coarser_patch_rms_of_peak"}
"""The distance of an answer from that of quadratic elements one level coarser than the finest, by kind of error."""

ACCURACY_VS_TIME = Table(
    "accuracy_vs_time",
    "The error against the truth, the time, the preparation and the memory of every model at each of its settings.",
    """
    scene body regime: a body under a regime of loads
    model setting: what answers
    sees prepared law protocol: what it is given, whether its contacts were prepared, its law, and the coarse answers
    split samples failures: number of the split of the contacts, test samples, and those without an answer
    rejected rejected_answered: validation and test samples without a truth, and those of them that it answered without
        a doubt or a failure
    rmse_m rmse_of_peak relative_l2 p95_of_peak max_of_peak: mean errors over the surface [m, peak, -, peak, peak]
    patch_rms_of_peak patch_max_of_peak: mean errors at the disc that is pressed [peak]
    operator_rmse_of_peak: error against the finest mesh alone [peak]
    rmse_of_peak_median rmse_of_peak_p95 relative_l2_median relative_l2_p95: median and 95th percentile of samples
    patch_rms_of_peak_median patch_rms_of_peak_p95 patch_max_of_peak_median patch_max_of_peak_p95: the same at the disc
    validation_rmse_of_peak validation_patch_rms_of_peak: mean errors on the samples that choose settings
    online_median_s online_p95_s online_max_s: time of an answer, and of the slowest press (median of its calls) [s]
    offline_s memory_mb: preparation [s], and memory [1e6 bytes]
    break_even_queries: answers after which the preparation has paid, against quadratic elements
    threads commit failure: threads, commit of the code, and the first reason of a failure
    """,
)


class Presses(Kind):
    """The presses of a judge's samples; rows of settings have means over those of the test side alone.

    place : the module of the model, which errors name; reduces : whether it reduces the fine operator
    more_of : a regular expression. A setting in whose name it is found is asked the presses ``judge.training`` too,
        unless it has learnt from training samples. They are not timed and no part of means: they give bounds of errors
        more contacts.
    Every setting is asked the presses ``judge.rejected``, too, untimed: they have no truth, and a model that knows its
    limits doubts or refuses them.
    """

    question = ("side", "sample", "contact")
    errors = (*ERRORS, OPERATOR)
    largest = ("max_of_peak",)
    spread = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak", "patch_max_of_peak")
    more = (ESTIMATED, *COARSER.values())
    sums_failed = True
    table = ACCURACY_VS_TIME

    def __init__(
        self, labels: Row, judge: Judge, place: str = "a model", reduces: bool = False, more_of: str | None = None
    ):
        questions = zip(judge.side, judge.numbers, judge.samples.contact, strict=True)
        question_columns = [dict(zip(self.question, each, strict=True)) for each in questions]
        super().__init__(labels | {"split": judge.split}, question_columns, judge.truth.shape[1], place)
        self.judge, self._reduces, self._more_of = judge, reduces, more_of

    def call(self, solver: Solver, i: int) -> Call:
        return _call(solver, Load.at(self.judge.samples.contact[i], self.judge.samples.force[i].copy()))

    def judged(self, i: int, answer: np.ndarray | Answer) -> Row:
        moved = displacement_of(answer)
        columns: Row = self.judge.errors(i, moved)._asdict()
        if self._reduces:
            columns[OPERATOR] = self.judge.operator_error(i, moved)
        if isinstance(answer, Answer) and answer.error is not None:
            columns[ESTIMATED] = answer.error
        return columns | dict(zip(COARSER.values(), self.judge.from_coarser(i, moved), strict=True))

    @classmethod
    def means(cls, rows: list[Row]) -> Row:
        """Return the columns of a setting; errors are means over test samples, times over all samples.

        Errors on validation samples are empty unless all of these were answered.
        """
        validation, tests = ([row for row in rows if row["side"] == side] for side in SIDES)
        columns = pd.DataFrame(validation, columns=CHOSEN_BY, dtype=float).mean(skipna=False).add_prefix("validation_")
        all_means = super().means(rows)
        of_all = {name: all_means[name] for name in all_means if name == "failure" or name.startswith("online")}
        return columns.to_dict() | {"protocol": "live"} | super().means(tests) | of_all

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Ask the presses of training contacts and those without a truth, untimed."""
        unprepared, more_rows = isinstance(one.solver, NotConverged), list[Row]()
        answered = [row["failure"] == "" for row, known in zip(rows, self.judge.believed, strict=True) if not known]
        no_more = self._more_of is None or "training" in one.used or not re.search(self._more_of, one.about["setting"])
        if self.judge.training and not (no_more or unprepared):
            more_rows = ask(Presses(self.labels, self.judge.training, self.place, self._reduces), one.solver, 0, 0.0)
        if (rejected := self.judge.rejected) is not None:
            loads = loads_of(rejected.contact, rejected.force.copy())
            answered += [not unprepared and self._answers(one.solver, load) for load in loads]
        return {"rejected": len(answered), "rejected_answered": sum(answered)}, more_rows

    def _answers(self, solver: Solver, load: Load) -> bool:
        """Return whether ``solver`` answers a load without a doubt or a failure."""
        try:
            checked(_call(solver, load)(), self.judge.truth.shape[1], self.place)
        except NotConverged:
            return False
        return True


def _call(solver: Solver, load: Load) -> Callable[[], np.ndarray | Answer]:
    solver.precede(load)
    return partial(solver.respond, load)


def labels_of(case: Case) -> Row:
    """Return the columns that name the body and the regime of loads of a case."""
    return {"scene": f"{case.body.name}_{case.regime}", "body": case.body.name, "regime": case.regime}


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
    """Measure the settings ``models`` of the model ``name`` on presses: a row a sample, and a row a setting.

    repeats, budget_s : as of ``time_calls``; more_of : as of ``Presses``
    progress : wraps the sequence of settings, as ``tqdm`` does
    """
    place, reduces = (models[0].place, models[0].reduces != "") if models else ("", False)
    kind = Presses(labels_of(case), judge, place, reduces, more_of)
    settings = prepared_settings(case, name, models, progress=progress)
    return tables(kind, *measuring.measure(kind, settings, repeats, budget_s))


def failed(case: Case, model: Model, judge: Judge, why: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a model that has failed on every sample because of ``why``, as ``measure`` does."""
    kind, about = Presses(labels_of(case), judge), about_of(model.name, model, case)
    return tables(kind, *measuring.measure(kind, [Prepared(about, NotConverged(why, []), np.nan)], 0, 0.0))


def warn_unanswered(name: str, settings: pd.DataFrame) -> None:
    """Warn if one's own model has answered no sample with any setting; ``settings`` as ``measure`` returns them."""
    if len(settings) and (settings["failures"] == settings["samples"]).all():
        warnings.warn(f"own_models.{name} answered no sample: {settings['failure'].iloc[0]}", stacklevel=2)


def bounds(case: Case, judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the truth's own errors and those of no displacement at all, as if "truth" and "zero" were models.

    There are rows of the truth for ``judge.training`` too. Its time is that of its solutions on all levels; the answer
    zero has none.
    """
    kind = Presses(labels_of(case), judge)
    own_rows, zero_rows = _own(kind), kind.rows()
    for i, row in enumerate(zero_rows):
        row |= judge.errors(i, np.zeros_like(judge.truth[i]))._asdict()
    training_rows = _own(Presses(labels_of(case), judge.training)) if judge.training else []
    about = kind.labels | {"sees": "load", "prepared": False, "offline_s": 0.0, "memory_mb": 0.0}
    about |= {"rejected": 0, "rejected_answered": 0}
    truth = about | {"model": TRUTH, "setting": OWN_ERROR, "law": case.body.material.law}
    zero = about | {"model": ZERO, "setting": "default", "law": ""}
    questions = [truth | row for row in (*own_rows, *training_rows)] + [zero | row for row in zero_rows]
    return tables(kind, questions, [truth | kind.means(own_rows), zero | kind.means(zero_rows)])


def _own(kind: Presses) -> list[Row]:
    """Return rows of the truth's own errors and times."""
    own = zip(kind.rows(), kind.judge.own, kind.judge.own_seconds, strict=True)
    return [row | dict(zip(ERRORS, errors, strict=True)) | spent([float(seconds)]) for row, errors, seconds in own]
