"""Estimate the error of a model's motion without a reference, from a longer step and from forces on a finer mesh."""

from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from palpate.errors import NotConverged
from palpate.linalg.multigrid import Factor
from palpate.models.fem_statics import to_fine
from palpate.models.reduced_motion import MotionInModes, ReducedMotion, misses, move
from palpate.scenes.motion import Motion
from palpate.scenes.run_scene import compose
from palpate.scenes.scene_check import RELAXED
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.fitted import Fitted, corrects

ORDERS = {"backward_euler": 1, "bdf2": 2, "midpoint": 2}
"""Order of the steps of each integrator whose steps are long enough to matter; explicit ones take far shorter ones."""


class MotionEstimate(NamedTuple):
    """The estimated error of a motion over the peak of its displacements, NaN if it is not known, and its time [s]."""

    estimate_of_peak: float = np.nan
    estimate_s: float = np.nan


def estimate(compared: ComparedScene, fitted: Fitted, steps: int, motion: Motion, moved: np.ndarray) -> MotionEstimate:
    """Estimate the error of the ``motion`` of a model in ``steps``: √(step² + mesh²).

    moved : its displacements (f, n_surface, 3) [m]
    The error of the step is what ``twice_as_long`` changes, that of the mesh is ``mesh_residual``, which a model on the
    reference's own mesh does not have. There is no estimate where bodies touch, yield or drift, of a model that answers
    on the surface alone, and of iterations that are stopped early, whose error is alike in longer steps.
    """
    integrator = fitted.scene(compared, steps).integrator
    if not corrects(compared) or fitted.finish is not None or compared.frames < 2 or integrator in RELAXED:
        return MotionEstimate()
    level = fitted.level % len(compared.body.levels)
    of_step, of_mesh, seconds = 0.0, 0.0, 0.0
    if integrator in ORDERS:
        try:
            of_step, seconds = twice_as_long(compared, fitted, steps, moved)
        except NotConverged:
            return MotionEstimate()
    begin = perf_counter()
    if level < len(compared.body.levels) - 1:
        of_mesh = mesh_residual(compared, level, motion)
    peak = np.linalg.norm(moved, axis=2).max()
    return MotionEstimate(float(np.hypot(of_step, of_mesh) / peak), seconds + perf_counter() - begin)


def twice_as_long(compared: ComparedScene, fitted: Fitted, steps: int, moved: np.ndarray) -> tuple[float, float]:
    """Run a model in steps twice as long, which meet every second frame; return ``error_of_step`` [m] and the time [s].

    moved : displacements (f, n_surface, 3) [m] in ``steps``
    """
    count = compared.frames // 2
    half = replace(compared, frames=count, duration_s=compared.duration_s * (2 * count) / compared.frames)
    scene = fitted.scene(half, steps // compared.frames * count)
    longer, run = half.move(scene, fitted.level % len(compared.body.levels), fitted.young_pa)
    return error_of_step(longer, moved[1::2][:count], scene.integrator), run.seconds


def error_of_step(longer: np.ndarray, shorter: np.ndarray, integrator: str) -> float:
    """Return the RMS [m] between motions (f, n, 3) [m] in steps of some length and of half of it, over 2ᵏ − 1.

    k is the order of the integrator, so that this estimates the error in the shorter steps (Richardson 1911).
    """
    rms = float(np.sqrt(np.mean(np.sum((longer - shorter) ** 2, axis=2))))
    return rms / (2.0 ** ORDERS[integrator] - 1.0)


def mesh_residual(compared: ComparedScene, level: int, motion: Motion) -> float:
    """Return the RMS [m] over the surface of one Newton step of the fine mesh, in the frame that is deflected most.

    motion : on ``level``, interpolated to the fine mesh, on which its forces, inertia and damping included, do not
    balance; velocities and accelerations are differences of frames. Trap: the inertia of swings that are shorter than
    two frames is lost.
    """
    displacements = motion.positions - motion.rest
    frame = int(np.linalg.norm(displacements, axis=2).max(axis=1)[1:-1].argmax()) + 1
    before, at_frame, after = (to_fine(compared.body, level) @ displacements[frame + shift] for shift in (-1, 0, 1))
    frame_s = float(motion.times[frame + 1] - motion.times[frame])
    particles = compared.particles(len(compared.body.levels) - 1)
    system = compose(compared.fem(compared.frames), particles)
    system.at(float(motion.times[frame]))
    x = particles.nodes + at_frame
    inertia = system.masses[:, None] * (after - 2.0 * at_frame + before) / frame_s**2
    residual = np.where(system.free[:, None], system.force(x, (after - before) / (2.0 * frame_s)) - inertia, 0.0)
    matrix = system.stiffness(x, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    newton_step = Factor(matrix).solve(residual)[compared.body.fine.surface]
    return float(np.sqrt(np.mean(np.sum(newton_step**2, axis=1))))


def estimate_in_modes(compared: ComparedScene, motion: ReducedMotion, simulated: MotionInModes) -> MotionEstimate:
    """Estimate the error of a motion in modes: of its step as ``estimate``, and of its modes by ``misses``.

    There is no estimate where steps twice as long are not found.
    """
    begin, count = perf_counter(), compared.frames // 2
    peak = np.linalg.norm(simulated.moved, axis=2).max()
    if not count:
        return MotionEstimate()
    until = 2 * count * compared.duration_s / compared.frames
    try:
        longer = move(motion, until, count, len(simulated.reached) // compared.frames * count).moved
    except NotConverged:
        return MotionEstimate()
    of_step = error_of_step(longer, simulated.moved[1::2][:count], "midpoint")
    return MotionEstimate(float(np.hypot(of_step, misses(motion, simulated)) / peak), perf_counter() - begin)
