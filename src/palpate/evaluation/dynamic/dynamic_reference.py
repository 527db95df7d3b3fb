"""Find how a scene really moves: fine implicit finite elements at steps that are halved until that changes nothing."""

import warnings
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from palpate.errors import NotConverged
from palpate.evaluation.dynamic.dynamic_trial import Trial
from palpate.files import write_whole

LOOSER = 4.0
"""How many times the change of the step may be as large in the motion that models are fitted to."""


@dataclass(frozen=True, eq=False)
class Reference:
    """Surface displacements [m] at the ends of f frames.

    truth : (f, n_surface, 3), extrapolated to steps of no length; change : what halving the step last changed it by,
        in parts of its peak; step_s : the shortest step
    tried : (m, f, n_surface, 3) of steps ``tried_s`` (m,), as they are; seconds,
        step_p95_s : (m,) what each took, and 95 % of its steps at most
    training : (f, n_surface, 3), the truth under ``training_share`` of the loads, which models are fitted to
    duration_s : how long the scene is followed
    """

    truth: np.ndarray
    change: float
    step_s: float
    tried: np.ndarray
    tried_s: np.ndarray
    seconds: np.ndarray
    step_p95_s: np.ndarray
    training: np.ndarray
    training_share: float
    duration_s: float

    @property
    def peak(self) -> float:
        """The largest displacement [m]."""
        return float(np.linalg.norm(self.truth, axis=-1).max())


def reference(trial: Trial, change: float, training_share: float, max_halvings: int) -> Reference:
    """Simulate the motion of ``trial`` and that under ``training_share`` of its loads.

    change : of the extrapolated motion at a halving, below which it ends: RMSE of the worst frame over the peak
    max_halvings : of the step, from one a frame; NotConverged if they are not enough
    Backward Euler's error is of first order in the step, so 2 u(h/2) − u(h) is of second.
    """
    truth, last, steps, tried, spent = _halve(trial, change, max_halvings)
    training = _halve(trial.scale_loads(training_share), LOOSER * change, max_halvings)[0]
    seconds, p95 = np.array(spent).T
    found = truth, last, steps[-1], np.array(tried), np.array(steps), seconds, p95
    return Reference(*found, training, training_share, trial.duration_s)


def reference_of_part(trial: Trial, change: float, training_share: float, max_halvings: int, shorter: int) -> Reference:
    """Do as ``reference``, for half of the duration where the whole is not found, and so on ``shorter`` times.

    Warns of the duration that it comes to; NotConverged if the shortest is not found either.
    """
    try:
        found = reference(trial, change, training_share, max_halvings)
    except NotConverged as failure:
        if not shorter:
            raise
        half = replace(trial, duration_s=0.5 * trial.duration_s)
        warnings.warn(
            f"scenes.{trial.name}: models are compared in its first {half.duration_s:.3g} s at most, as no reference "
            f"of {trial.duration_s:.3g} s was found: {failure}.",
            stacklevel=2,
        )
        return reference_of_part(half, change, training_share, max_halvings, shorter - 1)
    return found


def _halve(
    trial: Trial, change: float, max_halvings: int
) -> tuple[np.ndarray, float, list[float], list[np.ndarray], list[tuple[float, float]]]:
    steps, tried, costs, before, history = [], [], [], None, []
    for halving in range(max_halvings + 1):
        scene = trial.fem(trial.frames * 2**halving)
        displacement, run = trial.move(scene, len(trial.body.levels) - 1)
        steps.append(scene.step_s)
        tried.append(displacement)
        costs.append((run.seconds, run.step_p95_s))
        if halving:
            truth = 2.0 * tried[-1] - tried[-2]
            if before is not None:
                history.append(_difference(truth, before))
                if history[-1] <= change:
                    return truth, history[-1], steps, tried, costs
            before = truth
    raise NotConverged(
        f"{trial.name}: halving the step to {steps[-1]:.2g} s still changes the motion by {history[-1]:.2%} of its "
        "peak; allow more change, or damp the scene more",
        history,
    )


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the RMSE over nodes of the frame where it is largest, over the peak of ``a``."""
    rmse = np.sqrt(np.mean(np.sum((a - b) ** 2, axis=2), axis=1))
    return float(rmse.max() / np.linalg.norm(a, axis=2).max())


def save(found: Reference, path: Path | str) -> None:
    """Write it whole or not at all."""
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, **vars(found))


def load(path: Path | str) -> Reference:
    """Read what ``save`` wrote."""
    with np.load(path) as file:
        kept = {field.name: file[field.name] for field in fields(Reference)}
    return Reference(
        **kept | {name: float(kept[name]) for name in ("change", "step_s", "training_share", "duration_s")}
    )
