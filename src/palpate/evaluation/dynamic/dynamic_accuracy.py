"""Measure the error of each model's motion, and what it costs: scenes against fine implicit finite elements."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from palpate.errors import NotConverged
from palpate.evaluation.accuracy import errors
from palpate.evaluation.dynamic.dynamic_fit import Fitted, fit_shapes, fit_springs
from palpate.evaluation.dynamic.dynamic_reference import Reference
from palpate.evaluation.dynamic.dynamic_trial import Trial

Grid = Mapping[str, Any]


def measure(trial: Trial, truth: Reference, grid: Mapping[str, Grid], progress: Callable = iter) -> pd.DataFrame:
    """Tabulate dynamic_accuracy.csv, a row a model and setting; errors are over all frames and surface nodes.

    grid : by model, the values to try of its settings: ``dynamic.settings`` of the config
    Columns: failures is 1 for a motion that ended in NotConverged, whose errors are then empty. ms_per_step,
    step_p95_ms and real_time_factor, the seconds that a second of motion takes, are without preparation.
    ``progress`` wraps the models, as ``tqdm`` does.
    """
    trial = replace(trial, duration_s=truth.duration_s)
    models = {
        "fem_coarse": partial(_coarse, trial, grid["fem_coarse"]),
        "springs": partial(_springs, trial, truth, False, grid["springs"]),
        "springs_volume": partial(_springs, trial, truth, True, grid["springs"]),
        "shape_matching": partial(_shapes, trial, truth, grid["shape_matching"]),
    }
    rows = [_tried(trial, truth, number) for number in range(len(truth.tried))]
    for name in progress(list(models)):
        for steps, fitted in models[name]():
            rows.append({"model": name} | _row(trial, truth, steps, fitted))
    known = {
        "reference_level": len(trial.body.levels) - 1,
        "reference_nodes": len(trial.body.fine.nodes),
        "reference_step_s": truth.step_s,
        "reference_change": truth.change,
    }
    table = pd.DataFrame(rows).assign(**known)
    table.insert(0, "scene", trial.name)
    table.insert(1, "body", trial.body.name)
    return table


def _coarse(trial: Trial, grid: Grid) -> Iterator[tuple[int, Fitted]]:
    for count in grid["steps_per_frame"]:
        yield count * trial.frames, Fitted(lambda trial, steps: trial.fem(steps), trial.body.material.young_pa, 0.0)


def _springs(trial: Trial, truth: Reference, volume: bool, grid: Grid) -> Iterator[tuple[int, Fitted]]:
    shares = grid["shares_of_stable_step"]
    fitted = fit_springs(trial, truth, volume, max(shares), grid["evaluations"])
    limit = trial.limit_s(fitted.scene(trial, trial.frames), fitted.young_pa)
    for share in shares:
        yield trial.steps(share * limit), fitted


def _shapes(trial: Trial, truth: Reference, grid: Grid) -> Iterator[tuple[int, Fitted]]:
    for count in grid["steps_per_frame"]:
        yield count * trial.frames, fit_shapes(trial, truth, count * trial.frames, grid["evaluations"])


def _row(trial: Trial, truth: Reference, steps: int, fitted: Fitted) -> dict:
    scene = fitted.scene(trial, steps)
    row = {"setting": f"step_s={scene.step_s:.3g}", "level": 0, "nodes": len(trial.body.coarse.nodes)}
    row |= {"step_s": scene.step_s, "steps": steps, "failures": 0}
    try:
        moved, run = trial.move(scene, 0, fitted.young_pa)
    except NotConverged:
        return row | {"failures": 1, "offline_s": fitted.offline_s}
    return (
        row | _errors(moved, truth) | _cost(run.seconds, run.step_p95_s, steps, trial) | {"offline_s": fitted.offline_s}
    )


def _tried(trial: Trial, truth: Reference, number: int) -> dict:
    """Take the reference at one of its steps, as it is: its error is that of the step alone."""
    step = float(truth.tried_s[number])
    steps = round(trial.duration_s / step)
    row = {"model": "fem_fine", "setting": f"step_s={step:.3g}", "level": len(trial.body.levels) - 1}
    row |= {"nodes": len(trial.body.fine.nodes), "step_s": step, "steps": steps, "failures": 0}
    costs = _cost(float(truth.seconds[number]), float(truth.step_p95_s[number]), steps, trial)
    return row | _errors(truth.tried[number], truth) | costs | {"offline_s": 0.0}


def _errors(moved: np.ndarray, truth: Reference) -> dict:
    return errors(moved.reshape(-1, 3), truth.truth.reshape(-1, 3))._asdict()


def _cost(seconds: float, step_p95_s: float, steps: int, trial: Trial) -> dict:
    spent = {"ms_per_step": 1e3 * seconds / steps, "step_p95_ms": 1e3 * step_p95_s}
    return spent | {"real_time_factor": seconds / trial.duration_s}
