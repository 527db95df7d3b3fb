"""Estimate how wrong a motion is from what its model knows: steps twice as long, and what a finer mesh would add."""

from time import perf_counter
from typing import NamedTuple

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.multigrid import Factor
from palpate.models.fem_statics import to_fine
from palpate.scenes.build_system import compose
from palpate.scenes.motion import Motion
from palpate.studies.dynamic.corrected_motion import corrects
from palpate.studies.dynamic.dynamic_fit import Fitted
from palpate.studies.dynamic.dynamic_trial import Trial

ORDERS = {"backward_euler": 1, "bdf2": 2, "reduced": 2}
"""Order of the steps of each integrator whose steps are long enough to matter; explicit ones take far shorter ones."""


class MotionEstimate(NamedTuple):
    """Hold the share of the peak by which a motion may be wrong, empty (NaN) if it is not known, and its time [s]."""

    estimate_of_peak: float = np.nan
    estimate_s: float = np.nan


def estimated(trial: Trial, fitted: Fitted, steps: int, motion: Motion, moved: np.ndarray) -> MotionEstimate:
    """Estimate the error of a model's motion without a reference: √(step² + mesh²).

    motion, moved : of the model in so many ``steps``, and its displacements (f, n_surface, 3) [m]
    The step's part is by how much ``twice_as_long`` changes it, the mesh's part that of ``mesh_residual``, which a
    model on the reference's own mesh does without. There is none where bodies touch, yield or drift, nor for answers
    that are known on the surface alone.
    """
    if not corrects(trial) or fitted.finish is not None or trial.frames < 2:
        return MotionEstimate()
    integrator = fitted.scene(trial, steps).integrator
    own = fitted.level % len(trial.body.levels)
    of_step, of_mesh, seconds = 0.0, 0.0, 0.0
    if integrator in ORDERS:
        try:
            of_step, seconds = twice_as_long(trial, fitted, steps, moved)
        except NotConverged:
            return MotionEstimate()
    begin = perf_counter()
    if own < len(trial.body.levels) - 1 or integrator == "reduced":
        of_mesh = mesh_residual(trial, own, motion)
    peak = np.linalg.norm(moved, axis=2).max()
    return MotionEstimate(float(np.hypot(of_step, of_mesh) / peak), seconds + perf_counter() - begin)


def twice_as_long(trial: Trial, fitted: Fitted, steps: int, moved: np.ndarray) -> tuple[float, float]:
    """Return ``change_of_step`` [m] of steps twice as long, which meet every second frame, and their time [s]."""
    count = trial.frames // 2
    half = trial.cut(2 * count).joined(2)
    scene = fitted.scene(half, steps // trial.frames * count)
    longer, run = half.move(scene, fitted.level % len(trial.body.levels), fitted.young_pa)
    return change_of_step(longer, moved[1::2][:count], scene.integrator), run.seconds


def change_of_step(longer: np.ndarray, shorter: np.ndarray, integrator: str) -> float:
    """Return the RMSE [m] between motions (f, n, 3) [m] at a step and at half of it, over 2ᵏ − 1 for order k."""
    off = float(np.sqrt(np.mean(np.sum((longer - shorter) ** 2, axis=2))))
    return off / (2.0 ** ORDERS[integrator] - 1.0)


def mesh_residual(trial: Trial, level: int, motion: Motion) -> float:
    """Return the RMS [m] over the surface of one Newton step of the fine mesh, at the frame that is deflected most.

    motion : on ``level``, interpolated to the fine mesh, whose forces there, inertia and damping included, do not
    balance; velocities and accelerations are those between frames. Trap: the inertia of swings that are shorter than
    two frames is lost.
    """
    moved = motion.positions - motion.rest
    number = int(np.linalg.norm(moved, axis=2).max(axis=1)[1:-1].argmax()) + 1
    before, here, after = (to_fine(trial.body, level) @ moved[number + side] for side in (-1, 0, 1))
    h = float(motion.times[number + 1] - motion.times[number])
    last = len(trial.body.levels) - 1
    particles = trial.particles(last)
    system = compose(trial.fem(trial.frames), particles)
    system.at(float(motion.times[number]))
    x = particles.nodes + here
    inertia = system.masses[:, None] * (after - 2.0 * here + before) / h**2
    residual = np.where(system.free[:, None], system.force(x, (after - before) / (2.0 * h)) - inertia, 0.0)
    matrix = system.stiffness(x, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    lacking = Factor(matrix).solve(residual)[trial.body.fine.surface]
    return float(np.sqrt(np.mean(np.sum(lacking**2, axis=1))))
