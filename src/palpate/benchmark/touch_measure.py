"""Measure models on touches: a row a touch and a row a setting, as ``measure`` does of presses."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from time import perf_counter
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.model import LeftOut, Setting, checked, setting_text
from palpate.benchmark.ranking import OWN_ERROR, TRUTH
from palpate.benchmark.settings import instrument_name
from palpate.benchmark.timing import online, said, time_calls
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver
from palpate.benchmark.touch_truth import TouchErrors, TouchTruth, patch_of, touch_errors
from palpate.errors import NotConverged

LABELS = ["scene", "body", "instrument", "radius_m", "model", "setting"]
KIND = ["sees", "prepared", "law"]
SIGNED = ("force_error", "stiffness_error", "contact_area_error")
"""Errors with a sign: means keep it, and medians and percentiles are of their size."""
SPREAD = ("rmse_of_peak", "patch_rms_of_peak", *SIGNED)
MORE = ["penetration_of_depth", "reaction_error", "preparation_s", "seconds"]
SAMPLE_COLUMNS = [*LABELS, "sample", "node", *TouchErrors._fields, *MORE, "failure"]
SETTING_COLUMNS = [
    *LABELS, *KIND, "samples", "failures", "rejected", *TouchErrors._fields,
    *(f"{name}_{part}" for name in SPREAD for part in ("median", "p95")),
    "penetration_of_depth", "reaction_error", "online_median_s", "online_p95_s", "online_max_s", "preparation_s",
    "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip
LAW = "the body's"
"""The law of models that take it from the body."""


def load_model(place: str, keywords: Mapping[str, Any]) -> SimpleNamespace:
    """Return ``settings(case)``, ``online(case, **setting)`` and LAW of the module ``place``, for ``measure_touches``.

    keywords : which of the module's variants it is
    """
    module = import_module(place)
    functions = {name: partial(getattr(module, name), **keywords) for name in ("settings", "online")}
    return SimpleNamespace(**functions, LAW=getattr(module, "LAW", ""))


def measure_touches(
    case: TouchCase,
    name: str,
    model: ModuleType | SimpleNamespace,
    touches: Sequence[Touch],
    truth: TouchTruth,
    repeats: int,
    budget_s: float,
    progress: Callable = iter,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Measure all settings of a model on the touches whose truth is believed: rows of both tables.

    repeats, budget_s : as of ``time_calls``; progress : wraps the settings, as ``tqdm`` does
    On one BLAS thread. A setting that cannot be prepared has failed on every touch; a model that does not know such a
    body has no rows.
    """
    from threadpoolctl import threadpool_limits

    rows = np.flatnonzero(truth.believed)
    samples: list[dict[str, Any]] = []
    with threadpool_limits(limits=1):
        settings = []
        for setting in progress(model.settings(case)):
            try:
                found, about = _measured(case, model, setting, touches, truth, rows, repeats, budget_s)
            except LeftOut:
                continue
            labels = _labels(case) | {"model": name, "setting": setting_text(setting)}
            samples += [labels | row for row in found]
            about |= {"sees": "load", "law": getattr(model, "LAW", ""), "rejected": int((~truth.believed).sum())}
            settings.append(labels | about | means(found))
    return pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings, columns=SETTING_COLUMNS)


def truth_rows(case: TouchCase, touches: Sequence[Touch], truth: TouchTruth) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the truth's own errors as if it were a model."""
    found = [
        {"sample": int(truth.sample[row]), "node": touches[int(row)].node, "failure": ""}
        | dict(zip(TouchErrors._fields, truth.own[row], strict=True))
        | {"penetration_of_depth": truth.overlap[row], "seconds": truth.seconds[row]}
        for row in np.flatnonzero(truth.believed)
    ]
    labels = _labels(case) | {"model": TRUTH, "setting": OWN_ERROR}
    times = {"offline_s": 0.0, "preparation_s": 0.0, "memory_mb": 0.0}
    about = {"sees": "load", "prepared": False, "law": LAW, "rejected": int((~truth.believed).sum())}
    table = pd.DataFrame([labels | times | about | means(found)], columns=SETTING_COLUMNS)
    return pd.DataFrame([labels | row for row in found], columns=SAMPLE_COLUMNS), table


def _labels(case: TouchCase) -> dict[str, Any]:
    body, tool = case.body.name, case.instrument
    scene = f"{body}_{instrument_name(tool)}"
    return {"scene": scene, "body": body, "instrument": tool.kind, "radius_m": tool.radius_m}


def _measured(
    case: TouchCase,
    model: ModuleType | SimpleNamespace,
    setting: Setting,
    touches: Sequence[Touch],
    truth: TouchTruth,
    rows: np.ndarray,
    repeats: int,
    budget_s: float,
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Return a row for each touch, and what preparing has taken."""
    count = len(case.body.fine.surface)
    found: list[dict[str, Any]] = [
        {"sample": int(truth.sample[r]), "node": touches[r].node, "failure": ""} for r in rows
    ]
    begin = perf_counter()
    try:
        solver = model.online(case, **setting)
    except NotConverged as failure:
        if isinstance(failure, LeftOut):
            raise
        about = {"offline_s": perf_counter() - begin, "prepared": False}
        return [row | {"failure": said(failure)} for row in found], about
    offline = perf_counter() - begin
    asked = []
    for row, r in zip(found, rows, strict=True):
        touches[r].pose(case.body)  # where it first touches is part of the question
        begin = perf_counter()
        try:
            solver.prepare(touches[r])
        except NotConverged as failure:
            row["failure"] = said(failure)
        else:
            asked.append((row, r))
        row["preparation_s"] = perf_counter() - begin

    def receive(i: int, answer: Touched) -> None:
        row, r = asked[i]
        checked(answer.displacement, count)
        touch = touches[r]
        if "force_error" in row:
            return
        row |= touch_errors(answer, truth.answer(r), patch_of(case.body, touch))._asdict()
        row["penetration_of_depth"] = penetration(case, touch, answer)
        row["reaction_error"] = answer.reaction_n / truth.force[r, 1] - 1.0
        answers[i] = answer.force_n

    answers: dict[int, float] = {}
    if asked:
        calls = [_Call(solver, touches[r]) for _, r in asked]
        timed = time_calls(calls, repeats, budget_s, receive)
        for (row, _), why, seconds in zip(asked, timed.failures, timed.seconds, strict=True):
            row["failure"] = why
            row["seconds"] = float(np.median(seconds)) if seconds else np.nan
            row["all_seconds"] = seconds
        for i, force in answers.items():
            row, r = asked[i]
            row["stiffness_error"] = _slope_error(solver, touches[r], force, truth.force[r])
    memory = float(solver.memory_mb)
    prepared = type(solver).prepare is not TouchSolver.prepare
    return found, {"offline_s": offline, "memory_mb": memory, "prepared": prepared}


def _slope_error(solver: TouchSolver, touch: Touch, force: float, true: np.ndarray) -> float:
    """Return the error of the slope of the force over depth; NaN where there is no answer before the whole depth."""
    try:
        before = solver.respond(touch.before).force_n
    except NotConverged:
        return np.nan
    return float((force - before) / (true[1] - true[0]) - 1.0)


class _Call:
    def __init__(self, solver: TouchSolver, touch: Touch):
        self._solver, self._touch = solver, touch

    def __call__(self) -> Touched:
        return self._solver.respond(self._touch)


def penetration(case: TouchCase, touch: Touch, answer: Touched) -> float:
    """Return the deepest overlap of the fine surface nodes with the instrument, over the depth; NaN of a grasp."""
    if touch.grasps:
        return np.nan
    body, pose = case.body, touch.pose(case.body).moved(touch.depth_m * touch.direction)
    at = body.fine.nodes[body.fine.surface] + answer.displacement
    return max(0.0, -float(pose.gaps(at)[0].min())) / touch.depth_m


def means(found: list[dict[str, Any]]) -> dict[str, Any]:
    """Return means, medians and percentiles over the touches that were answered, and the times of all calls."""
    answered = [row for row in found if not row["failure"]]
    table = pd.DataFrame(answered, columns=[*SAMPLE_COLUMNS, "all_seconds"])
    columns = [*TouchErrors._fields, "penetration_of_depth", "reaction_error"]
    row: dict[str, Any] = {"samples": len(found), "failures": len(found) - len(answered), "threads": 1}
    row["failure"] = next((each["failure"] for each in found if each["failure"]), "")
    row |= table[columns].astype(float).mean().to_dict()
    for name in SPREAD:
        size = table[name].astype(float).abs()
        row |= {f"{name}_median": size.median(), f"{name}_p95": size.quantile(0.95)}
    row["preparation_s"] = pd.Series([each.get("preparation_s", np.nan) for each in found], dtype=float).mean()
    return row | online([seconds for seconds in table["all_seconds"] if isinstance(seconds, list)])
