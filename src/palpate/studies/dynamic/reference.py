"""Find what models in motion are judged by: the truth of a scene, or linear elements at steps that change nothing."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.motion_truth import MotionTruth, force_errors, motion_truth
from palpate.benchmark.richardson import limit
from palpate.bodies.body import Body
from palpate.errors import NotConverged
from palpate.stores import store
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.linear_limit import LinearLimit, linear_limit, resolved_frames
from palpate.studies.dynamic.settings import Truth
from palpate.table_declaration import Table

LOOSER = 4.0
"""How many times the change of the step may be as large in the motion that models are fitted to."""
LEAST_SHARE = 0.1
"""Of a scene's frames, below which a motion that is resolved no longer is of no use."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The standard: a motion of linear elements, extrapolated from m lengths of steps to steps of no length.

    It has the first f of ``of_frames`` frames, in which halving the step changes little; positions are at their ends.
    truth : (f, n_surface, 3) [m]; change : by the last halving of the step, over the peak; bound : what it may be
    step_s : the shortest step; tried_s : (m,) all steps, each half of the one before
    tried : (m, f, n_surface, 3) [m], the motions in these steps
    seconds : (m,) time of each for all frames; step_p95_s, step_max_s : (m,) of its steps
    changes : (m − 2, of_frames) of each frame by each halving after the first, over the peak of all frames
    duration_s : the time until the last of the f frames
    training : (g, n_surface, 3) [m], the motion that models are fitted to, until training_s; if none is fitted, g is 0
    force : (f, k, 3) [N] of k instruments, extrapolated as the motion; tried_force : (m, f, k, 3) [N]
    force_change : by the last halving of the step, RMS over the peak, NaN where nothing touches
    """

    truth: np.ndarray
    change: float
    step_s: float
    bound: float
    tried: np.ndarray
    tried_s: np.ndarray
    seconds: np.ndarray
    step_p95_s: np.ndarray
    step_max_s: np.ndarray
    changes: np.ndarray
    of_frames: int
    duration_s: float
    training: np.ndarray
    training_s: float
    force: np.ndarray
    force_change: float
    tried_force: np.ndarray

    @property
    def frames(self) -> int:
        """The number of frames that are resolved."""
        return len(self.truth)

    @property
    def peak(self) -> float:
        """The largest displacement [m]."""
        return float(np.linalg.norm(self.truth, axis=-1).max())

    def until(self, end_s: float) -> "Reference":
        """Return its frames that end by ``end_s`` [s], one at least."""
        frame = self.duration_s / self.frames
        count = min(self.frames, max(1, int(end_s / frame + 1e-6)))
        return replace(
            self,
            truth=self.truth[:count],
            tried=self.tried[:, :count],
            force=self.force[:count],
            tried_force=self.tried_force[:, :count],
            duration_s=count * frame,
        )


def reference(compared: ComparedScene, training: ComparedScene | None, change: float, max_halvings: int) -> Reference:
    """Find the standard of ``compared``, and of ``training``, the motion that models are fitted to, if any is.

    change : halving of steps ends where it changes the extrapolated motion by less: RMSE of the worst frame over peak
    max_halvings : of the step, from one a frame. Where they are not enough, the frames before remain, with a warning;
        NotConverged if these are less than LEAST_SHARE of all
    The error is of order k in the step, 2 for BDF2 and 1 for backward Euler. So u(h/2) + (u(h/2) − u(h)) / (2ᵏ − 1) is
    of order k + 1, but where bodies touch.
    """
    standard = converge(compared, change, max_halvings)
    taught = converge(training, LOOSER * change, max_halvings) if training else None
    if standard.frames < compared.frames:
        warnings.warn(
            f"scenes.{compared.name}: models are compared in its first {standard.duration_s:.3g} s of "
            f"{compared.duration_s:.3g} s, as steps of {standard.step_s:.2g} s still change what comes later by "
            f"{standard.changes[-1].max():.2%} of its peak.",
            stacklevel=2,
        )
    return replace(standard, training=taught.truth, training_s=taught.duration_s) if taught else standard


def converge(compared: ComparedScene, change: float, max_halvings: int) -> Reference:
    """Simulate a motion on the finest level in steps that are halved until they change little, see ``reference``."""
    lengths, motions, costs, changes, forces = [], [], [], [], []
    resolved = 0
    compared.begin(compared.fem(compared.frames), len(compared.body.levels) - 1)
    for halving in range(max_halvings + 1):
        scene = compared.fem(compared.frames * 2**halving)
        displacement, run = compared.move(scene, len(compared.body.levels) - 1)
        lengths.append(scene.step_s)
        motions.append(displacement)
        forces.append(run.motion.instrument_forces())
        costs.append((run.seconds, run.step_p95_s, run.step_max_s))
        if halving > 1:
            # the motions at steps of no length, from those at a step and at half of it
            previous, truth = _limits(motions, compared.order)
            change_m = np.sqrt(np.mean(np.sum((truth - previous) ** 2, axis=2), axis=1))
            peaks = np.linalg.norm(truth, axis=2).max(axis=1)
            changes.append(change_m / peaks.max())
            resolved = resolved_frames(change_m, peaks, change)
            if resolved == compared.frames:
                break
    if resolved < max(1, LEAST_SHARE * compared.frames):
        raise NotConverged(
            f"{compared.name}: halving the step to {lengths[-1]:.2g} s still changes the motion by "
            f"{changes[-1].max():.2%} "
            "of its peak; allow more change, or damp the scene more",
            [float(each.max()) for each in changes],
        )
    seconds, step_p95_s, step_max_s = np.array(costs).T
    force_before, force = (each[:resolved] for each in _limits(forces, compared.order))
    return Reference(
        truth=truth[:resolved],
        change=float((change_m[:resolved] / peaks[:resolved].max()).max()),
        step_s=lengths[-1],
        bound=change,
        tried=np.array(motions)[:, :resolved],
        tried_s=np.array(lengths),
        seconds=seconds,
        step_p95_s=step_p95_s,
        step_max_s=step_max_s,
        changes=np.array(changes),
        of_frames=compared.frames,
        duration_s=compared.duration_s * resolved / compared.frames,
        training=np.empty((0, *truth.shape[1:])),
        training_s=0.0,
        force=force,
        force_change=force_errors(force_before, force).force_rms_of_peak,
        tried_force=np.array(forces)[:, :resolved],
    )


def _limits(tried: list[np.ndarray], order: int) -> list[np.ndarray]:
    """Extrapolate the last two pairs of what was ``tried``, in steps that are halved, to steps of no length."""
    return [limit(np.array(pair), 2.0**order) for pair in pairwise(tried[-3:])]


DYNAMIC_REFERENCE = Table(
    "dynamic_reference",
    "What halving the reference's step changes in each frame, and which frames models are compared in.",
    """
    scene step_s time_s: a scene, the step that was halved, and the frame [s]
    change_of_peak bound resolved: the change, the bound at which halving ends, and whether the frame is compared
    """,
)


def tabulate(compared: ComparedScene, standard: Reference) -> pd.DataFrame:
    """Tabulate dynamic_reference.csv of one scene, a row a frame and halving; changes are RMSE over the whole peak."""
    times = compared.duration_s * np.arange(1, standard.of_frames + 1) / standard.of_frames
    parts = [
        pd.DataFrame({"step_s": step, "time_s": times, "change_of_peak": changes})
        for step, changes in zip(standard.tried_s[2:], standard.changes, strict=True)
    ]
    table = pd.concat(parts, ignore_index=True).assign(bound=standard.bound)
    table["resolved"] = table["time_s"] <= standard.duration_s * (1 + 1e-9)
    table.insert(0, "scene", compared.name)
    return table


MOTION_TRUTH = Table(
    "motion_truth",
    "How well a motion is known: the limit of quadratic elements in space and time, or what linear meshes say.",
    """
    scene elements levels steps: a scene, its elements, the number of levels, and the steps that all of them take
    until_s: up to when it is known; of linear elements when two meshes and two steps part [s]
    own_space own_time own_mixed: what the limit may be wrong by as the levels, the step, and the effect of the step on
        two levels show it: RMS over all frames and surface nodes, of the peak
    rmse_of_peak patch_rms_of_peak: all three together, over the surface and over what is pressed
    force_of_peak: what the instruments' force may be wrong by, RMS over all frames, of its peak; empty without any
    ratio least_det: by how much the last halving of the elements reduced the change; least det F of all levels
    balance: of the work of the loads on the finest level, what is neither kept nor damped
    rejected: why models are judged by the standard; of linear elements until when, beside what these say of it
    seconds: time of all its motions [s]
    """,
    always=False,
)


def tabulate_truth(compared: ComparedScene, truth: MotionTruth | LinearLimit) -> pd.DataFrame:
    """Tabulate motion_truth.csv of one scene, a row."""
    rms, patch = (truth.own[:, TruthErrors._fields.index(each)] for each in ("rmse_of_peak", "patch_rms_of_peak"))
    row = {"scene": compared.name, "patch_rms_of_peak": patch[3], "force_of_peak": truth.own_force}
    row |= dict(zip(("own_space", "own_time", "own_mixed", "rmse_of_peak"), rms, strict=True))
    row |= {"seconds": truth.spent_s}
    if isinstance(truth, LinearLimit):
        row |= {"elements": "linear", "levels": truth.levels, "steps": truth.steps}
        return MOTION_TRUTH.frame([row | {"until_s": truth.until_s, "rejected": truth.said}])
    tried = truth.tried
    row |= {"elements": "quadratic", "levels": len({t.level for t in tried}), "steps": min(t.steps for t in tried)}
    row |= {"until_s": compared.duration_s, "ratio": truth.ratio, "least_det": min(t.least_det for t in tried)}
    return MOTION_TRUTH.frame([row | {"balance": truth.finest.balance, "rejected": truth.rejected}])


PART = 0.05
"""Of the peak, by which two linear meshes and two steps may differ in a frame."""


def find_motion_truth(
    body: Body, output: Any, truth: Truth, compared: Compared, say: Callable, progress: Callable
) -> dict[str, pd.DataFrame]:
    """Find the truth of a scene's motion, or until when linear meshes agree on it, for the rule of that name."""
    if truth.elements == "linear":
        compared = compared.but(own=compared.own.but(level=truth.levels - 1))
    scene, count = compared.of(body), truth.steps_per_frame
    if truth.elements == "linear":
        agreed = linear_limit(scene, count, PART, progress)
        say(f"{scene.name}: {agreed.said}")
        store(agreed, output.truth, compressed=True)
        return {"table": tabulate_truth(scene, agreed)}
    motion_args = scene.body, scene.placed_loads(), scene.rayleigh, scene.duration_s
    result = motion_truth(*motion_args, scene.frames, count * scene.frames, truth.levels, progress)
    if result.rejected:
        warnings.warn(
            f"scenes.{scene.name}: its motion has no truth that is believed ({result.rejected}); models are judged by "
            "linear elements, which may be far from it. Press it less, or leave truth out.",
            stacklevel=1,
        )
    say(f"{scene.name}: known to {result.own_error:.2%} of the peak")
    store(result, output.truth, compressed=True)
    return {"table": tabulate_truth(scene, result)}


def simulate_dynamic_reference(body: Body, output: Any, compared: Compared, say: Callable) -> dict[str, pd.DataFrame]:
    """Find the reference of a scene, for the rule of that name."""
    scene, training = compared.and_training(body)
    change, halvings = compared.own.change_of_peak, compared.own.max_halvings
    assert change and halvings  # as the rule says
    standard = reference(scene, training, change, halvings)
    say(f"{scene.name}: a step of {standard.step_s:.2g} s; halving it last changed {standard.change:.2%} of the peak")
    store(standard, output.reference, compressed=True)
    return {"table": tabulate(scene, standard)}
