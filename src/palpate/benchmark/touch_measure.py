"""Measure models on touches: what is asked, the errors of an answer, and the rows of both tables."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib import import_module
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.measuring import Call, Kind, Prepared, Row, prepared, tables
from palpate.benchmark.model import setting_text
from palpate.benchmark.ranking import OWN_ERROR, TRUTH
from palpate.benchmark.settings import instrument_name
from palpate.benchmark.touch import (
    Touch,
    TouchCase,
    Touched,
    TouchErrors,
    TouchSolver,
    TouchTruth,
    patch_of,
    touch_errors,
)
from palpate.errors import InputError, NotConverged
from palpate.table_declaration import Table

SIGNED = ("force_error", "stiffness_error", "contact_area_error")
"""Errors with a sign: means keep it, and medians and percentiles are of their size."""
LAW = "the body's"
"""The law of models that take it from the body."""

TOUCH = Table(
    "touch",
    "The errors against the truth, the time, the preparation and the memory of every model at each of its settings.",
    """
    scene body instrument radius_m: a body under an instrument, and the radius of that [m]
    model setting: what answers
    sees prepared law: what it is given, whether it prepares each place, and its law
    samples failures rejected: touches, those without an answer, and those without a truth, which are not asked
    rmse_of_peak patch_rms_of_peak patch_max_of_peak max_of_peak: mean errors over the surface, and in the dent,
        which is what lies within a radius of the instrument from where it first touches [peak]
    force_error stiffness_error contact_area_error: mean errors with their sign, over the truth's own: of the force at
        the depth asked, of its slope over depth, and of the area that touches; empty where a model does not tell it
    force_error_size stiffness_error_size contact_area_error_size: means of these without their sign
    rmse_of_peak_median rmse_of_peak_p95 patch_rms_of_peak_median patch_rms_of_peak_p95: medians and 95th percentiles
    force_error_median force_error_p95 stiffness_error_median stiffness_error_p95: the same, without the sign
    contact_area_error_median contact_area_error_p95: the same, without the sign
    rmse_of_peak_bound patch_rms_of_peak_bound force_error_bound: below which the error at another place stays in nine
        cases of ten, with the truth's own error; empty where fewer than nine touches are known
    force_error_coverage: share of the touches that stay below such a bound of others; empty below ten touches
    penetration_of_depth: the deepest overlap of a surface node with the instrument, over the depth; empty of a grasp
    reaction_error: mean error of the force as the body's supports feel it
    online_median_s online_p95_s online_max_s: time of an answer, and of the slowest touch (median of its calls) [s]
    preparation_s offline_s memory_mb: preparation of a place and of the body [s], and memory [1e6 bytes]
    threads failure: threads, and the first reason of a failure
    """,
)


class Touches(Kind):
    """The touches of one instrument on one body whose truth is believed; a ``Touched`` answers, or displacements do."""

    question = ("sample", "node")
    errors = (*TouchErrors._fields, "penetration_of_depth", "reaction_error")
    spread = ("rmse_of_peak", "patch_rms_of_peak", *SIGNED)
    more = ("preparation_s",)
    table = TOUCH

    def __init__(self, case: TouchCase, touches: Sequence[Touch], truth: TouchTruth, place: str = "a model"):
        body, tool, self.believed = case.body, case.instrument, np.flatnonzero(truth.believed)
        labels: Row = {"scene": f"{body.name}_{instrument_name(tool)}", "body": body.name}
        labels |= {"instrument": tool.kind, "radius_m": tool.radius_m}
        self.touches = [touches[int(row)] for row in self.believed]
        numbered = zip(truth.sample[self.believed], self.touches, strict=True)
        question_columns = [{"sample": int(sample), "node": touch.node} for sample, touch in numbered]
        super().__init__(labels, question_columns, len(body.fine.surface), place)
        self.case, self._truth = case, truth

    def begin(self, solver: TouchSolver) -> None:
        for touch in self.touches:
            touch.pose(self.case.body)  # where it first touches is part of the question

    def ready(self, solver: TouchSolver, i: int) -> None:
        solver.prepare(self.touches[i])

    def call(self, solver: TouchSolver, i: int) -> Call:
        return partial(solver.respond, self.touches[i])

    def judged(self, i: int, answer: Touched | np.ndarray) -> Row:
        touch, truth, answered = self.touches[i], self._truth.answer(self.believed[i]), self._as_touched(answer)
        columns: Row = touch_errors(answered, truth, patch_of(self.case.body, touch))._asdict()
        columns["penetration_of_depth"] = penetration(self.case, touch, answered)
        return columns | {"reaction_error": answered.reaction_n / truth.force_n - 1.0, "force_n": answered.force_n}

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        """Ask each touch at less depth, untimed, for the slope of the force; it is NaN where there is no answer."""
        for i, row in enumerate(rows):
            if not row["failure"]:
                row["stiffness_error"] = self._slope_error(one.solver, i, row["force_n"])
        took = pd.Series([row.get("preparation_s", np.nan) for row in rows], dtype=float)
        return {"rejected": int((~self._truth.believed).sum()), "preparation_s": took.mean()}, []

    def _slope_error(self, solver: TouchSolver, i: int, force: float) -> float:
        true_before, true = self._truth.force[self.believed[i]]
        try:
            before = self._as_touched(solver.respond(self.touches[i].before)).force_n
        except NotConverged:
            return np.nan
        return float((force - before) / (true - true_before) - 1.0)

    def _as_touched(self, answer: Touched | np.ndarray) -> Touched:
        touched = answer if isinstance(answer, Touched) else Touched(answer, np.nan)
        if all(isinstance(each, Real) for each in touched[1:]):
            return touched
        raise InputError(f"{self.place}: a force or area is no number; return Touched(displacement, force_n, area_m2).")


def touch_settings(
    case: TouchCase, name: str, place: str, progress: Callable = iter, **keywords: Any
) -> Iterator[Prepared]:
    """Prepare all settings of a model of palpate's in turn.

    name : of the model in tables; progress : wraps the settings, as ``tqdm`` does
    place : its module, with ``settings(case)``, ``online(case, **setting)`` and perhaps LAW
    keywords : further arguments of both functions, which choose one of the module's variants
    """
    module = import_module(place)
    for setting in progress(module.settings(case, **keywords)):
        about = {"model": name, "setting": setting_text(setting), "sees": "load", "law": getattr(module, "LAW", "")}
        ready = prepared(about, partial(module.online, case, **keywords, **setting))
        prepares = isinstance(ready.solver, TouchSolver) and type(ready.solver).prepare is not TouchSolver.prepare
        yield ready._replace(about=about | {"prepared": prepares})


def truth_rows(case: TouchCase, touches: Sequence[Touch], truth: TouchTruth) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the truth's own errors as if it were a model: a row a touch, and one row of means."""
    kind = Touches(case, touches, truth)
    own_rows = kind.rows()
    for row, truth_index in zip(own_rows, kind.believed, strict=True):
        row |= dict(zip(TouchErrors._fields, truth.own[truth_index], strict=True))
        row |= {"penetration_of_depth": truth.overlap[truth_index], "seconds": truth.seconds[truth_index]}
    about: Row = kind.labels | {"model": TRUTH, "setting": OWN_ERROR, "sees": "load", "prepared": False, "law": LAW}
    about |= {"offline_s": 0.0, "memory_mb": 0.0, "rejected": int((~truth.believed).sum())}
    return tables(kind, [about | row for row in own_rows], [about | kind.means(own_rows)])


def penetration(case: TouchCase, touch: Touch, answer: Touched) -> float:
    """Return the deepest overlap of the fine surface nodes with the instrument, over the depth; NaN of a grasp."""
    if touch.grasps:
        return np.nan
    body, pose = case.body, touch.pose(case.body).moved(touch.depth_m * touch.direction)
    moved_nodes = body.fine.nodes[body.fine.surface] + answer.displacement
    return max(0.0, -float(pose.gaps(moved_nodes)[0].min())) / touch.depth_m
