"""How wrong each model's motion is, and what it costs: scenes against fine implicit finite elements."""

from collections.abc import Callable, Iterator
from functools import partial

import pandas as pd

from palpate.errors import NotConverged
from palpate.evaluation.accuracy import errors
from palpate.evaluation.dynamic.dynamic_fit import SAFE, Fitted, fit_shapes, fit_springs
from palpate.evaluation.dynamic.dynamic_reference import Reference
from palpate.evaluation.dynamic.dynamic_trial import Trial

COARSE_STEPS = (1, 2, 4, 8, 16)
"""Steps a frame of coarse finite elements."""
SHORTER = (1, 2, 4)
"""By how much springs' steps are shorter than the longest that is safe."""
SHAPE_STEPS = (4, 8, 16)
"""Steps a frame of shape matching, fitted for each."""


def measure(trial: Trial, truth: Reference, progress: Callable = iter) -> pd.DataFrame:
    """Rows of dynamic_accuracy.csv, a row a model and setting; errors are over all frames and surface nodes.

    failures : 1 for a motion that ended in NotConverged, whose errors are then empty
    ms_per_step, step_p95_ms and real_time_factor, seconds over those it lasts, are of that one motion,
    without preparation
    ``progress`` wraps the models, as ``tqdm`` does.
    """
    models = {
        "fem_coarse": partial(_coarse, trial),
        "springs": partial(_springs, trial, truth, False),
        "springs_volume": partial(_springs, trial, truth, True),
        "shape_matching": partial(_shapes, trial, truth),
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


def _coarse(trial: Trial) -> Iterator[tuple[int, Fitted]]:
    for count in COARSE_STEPS:
        yield count * trial.frames, Fitted(lambda trial, steps: trial.fem(steps), trial.body.material.young_pa, 0.0)


def _springs(trial: Trial, truth: Reference, volume: bool) -> Iterator[tuple[int, Fitted]]:
    fitted = fit_springs(trial, truth.training, volume)
    limit = trial.limit_s(fitted.scene(trial, trial.frames), fitted.young_pa)
    for shorter in SHORTER:
        yield trial.steps(SAFE * limit / shorter), fitted


def _shapes(trial: Trial, truth: Reference) -> Iterator[tuple[int, Fitted]]:
    for count in SHAPE_STEPS:
        yield count * trial.frames, fit_shapes(trial, truth.training, count * trial.frames)


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
    """The reference's own steps, each as it is: what the step alone is wrong by."""
    step = float(truth.tried_s[number])
    steps = round(trial.duration_s / step)
    row = {"model": "fem_fine", "setting": f"step_s={step:.3g}", "level": len(trial.body.levels) - 1}
    row |= {"nodes": len(trial.body.fine.nodes), "step_s": step, "steps": steps, "failures": 0}
    costs = _cost(float(truth.seconds[number]), float(truth.step_p95_s[number]), steps, trial)
    return row | _errors(truth.tried[number], truth) | costs | {"offline_s": 0.0}


def _errors(moved, truth: Reference) -> dict:
    return errors(moved.reshape(-1, 3), truth.truth.reshape(-1, 3))._asdict()


def _cost(seconds: float, step_p95_s: float, steps: int, trial: Trial) -> dict:
    spent = {"ms_per_step": 1e3 * seconds / steps, "step_p95_ms": 1e3 * step_p95_s}
    return spent | {"real_time_factor": seconds / trial.duration_s}
