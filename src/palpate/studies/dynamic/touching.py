"""Models of a touched body in modes of strokes: those beside its path, or those of a region."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import errors
from palpate.benchmark.motion_truth import force_errors
from palpate.bodies import body_file
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.settings import Contact, Touching
from palpate.errors import NotConverged
from palpate.models import stroke_motion, strokes
from palpate.run.job import steps
from palpate.scenes.run_scene import Run, compose
from palpate.scenes.settings import Scene
from palpate.solvers.quadratic_motion import Reached
from palpate.stores import stored
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.fitted import Fitted
from palpate.studies.dynamic.strokes import Strokes, contact_of, learnt_from
from palpate.table_declaration import Table

MOTION_PLACES = Table(
    "motion_places",
    "The error of a motion at each other place of the push, or of each stroke held out, and what it says of it itself.",
    """
    scene body contact model setting: a scene, its body, the node that is pushed or the number of the stroke, and what
        answers; without a model where elements find no motion, or turn inside out in it
    failures: 1 where there is no answer, or one that knows that it is wrong
    rmse_of_peak estimate_of_peak estimate_s: error, what the model says of it itself, and the time that takes [s]
    force_rms_of_peak real_time_factor: error of an instrument's force, RMS over frames of its peak, and seconds for a
        second, of strokes
    peak_m reference reference_change reference_error: largest displacement, and of what errors are from as in
        dynamic_accuracy
    """,
    always=False,
)


def modes_of_strokes(compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], seed: int) -> Fitted:
    """Learn modes from strokes; those of a region are not shown the path of ``compared``.

    grid : the settings of the model; nodes are in reach that the path or a stroke of its kind passes, more of them
        than were shown
    """
    asked, begin = Touching(**{key: grid[key] for key in Touching.model_fields}), perf_counter()
    passing = None
    if "half_width_m" in grid:
        passing = learnt_from(compared, dict(grid) | {"strokes": MORE * grid["strokes"], "seed": seed})
    system = compose(compared.touching(compared.frames, asked), compared.particles(-1))
    body = stroke_motion.prepare(system, asked, shown.shown, passing)

    def in_modes(compared: ComparedScene, steps: int) -> Scene:
        return compared.touching(steps, stroke_motion.Learnt(**dict(asked), learnt=body))

    spent = shown.seconds + perf_counter() - begin
    return Fitted(in_modes, compared.body.material.young_pa, spent, level=-1)


MORE = 4
"""Strokes of a region that say what is in reach, for each that is learnt from."""


def tried(
    compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], seed: int
) -> Iterator[tuple[int, Fitted, str]]:
    """Yield steps in modes of strokes."""
    fitted = modes_of_strokes(compared, shown, grid, seed)
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fitted, ""


def doubted(run: Run, moved: np.ndarray) -> float:
    """Return the largest doubt of a motion, of the peak of its displacements ``moved`` (f, n_surface, 3) [m]."""
    return float(run.doubts_m.max() / np.linalg.norm(moved, axis=2).max())


STEP_S, TOLERANCE = 0.02, 1e-3
"""About the step of quadratic elements on a stroke held out, which is halved once for their limit; its tolerance."""


def measure_strokes(
    compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], count: int, seed: int, progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate errors and doubts of ``region_modes`` on strokes that it was not shown, a row a stroke and step.

    grid : as for ``modes_of_strokes``; seed : of the strokes that were shown
    The reference is the limit in time of quadratic elements on the same mesh. A stroke that is not found, or on which
    an instrument goes where nothing was prepared, is a failure; one that elements do not find, or on which they turn
    inside out, has no model.
    """
    fitted = modes_of_strokes(compared, shown, grid, seed)
    square = grid["half_width_m"], count, seed + HELD_OUT
    contacts = strokes.roaming(compared.particles(-1), contact_of(compared), *square)
    rows: list[dict] = []
    for number, contact in enumerate(progress(contacts)):
        each = stroked(compared, contact)
        rows += measure_stroke(each, limit_of(each), fitted, number, grid["steps_per_frame"])
    return MOTION_PLACES.frame(rows)


def stroked(compared: ComparedScene, contact: Contact) -> ComparedScene:
    """Return the scene with another stroke, in frames as long, so that steps are those there."""
    frames = max(1, round(strokes.DURATION_S * compared.frames / compared.duration_s))
    return replace(compared, duration_s=strokes.DURATION_S, frames=frames, loads=compared.loads.but(contact=contact))


@dataclass(frozen=True, eq=False)
class StrokeLimit:
    """The limit in time of quadratic elements on a stroke: displacement (f, n_surface, 3) [m], force (f, k, 3) [N].

    change : by the last halving of steps, RMSE over peak; no frames of a stroke that is not found, or on which
        elements turn inside out
    """

    displacement: np.ndarray
    force: np.ndarray
    change: float


def limit_of(each: ComparedScene) -> StrokeLimit:
    """Return the limit that two lengths of steps extrapolate to."""
    fewest = max(1, round(each.duration_s / each.frames / STEP_S))
    try:
        longer, shorter = (_of_elements(each, n * fewest) for n in (1, 2))
    except NotConverged:
        return StrokeLimit(np.zeros((0, 0, 3)), np.zeros((0, 0, 3)), np.nan)
    truth, force = ((4.0 * b - a) / 3.0 for a, b in zip(longer, shorter, strict=True))  # their steps are of order 2
    return StrokeLimit(truth, force, errors(shorter[0].reshape(-1, 3), truth.reshape(-1, 3)).rmse_of_peak)


def measure_stroke(
    each: ComparedScene, limit: StrokeLimit, fitted: Fitted, number: int, tried: Sequence[int]
) -> list[dict]:
    """Return the rows of ``measure_strokes`` of one stroke, for each number of steps in a frame that is ``tried``."""
    labels: dict = {"scene": each.name, "body": each.body.name, "contact": number}
    if not len(limit.displacement):
        return [labels]
    labels |= {"model": "region_modes", "reference": "fem_p2", "reference_change": limit.change}
    labels |= {"peak_m": np.linalg.norm(limit.displacement, axis=2).max()}
    return [labels | _held_out(each, fitted, n, limit) for n in tried]


def _of_elements(each: ComparedScene, per_frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (f, n_surface, 3) [m] of quadratic elements at frames' ends, mean forces (f, k, 3) [N].

    NotConverged where they turn inside out, too: such a motion is balanced, and none of tissue.
    """
    contact, surface = contact_of(each), each.body.fine.surface
    motion = strokes.elements_under(each.body, contact, each.rayleigh, strokes.points_of(each.body, [contact]))
    count = each.frames * per_frame
    reached: list[Reached] = []
    for end in motion.touched_steps(each.duration_s / count, count, TOLERANCE):
        if (det := motion.least_det(end.x)) <= 0.0:
            raise NotConverged(f"an element is turned inside out (det F {det:.2g}) after {len(reached) + 1} steps", [])
        reached.append(end)
    moved = np.array([(end.x - motion.rest)[surface] for end in reached[per_frame - 1 :: per_frame]])
    forces = np.array([end.forces for end in reached])
    return moved, forces.reshape(each.frames, per_frame, -1, 3).mean(axis=1)


HELD_OUT = 1000
"""Added to the seed of the strokes that are shown, for those that are not."""


def _held_out(each: ComparedScene, fitted: Fitted, per_frame: int, limit: StrokeLimit) -> dict:
    """Follow one stroke; return errors and doubt."""
    scene = fitted.scene(each, per_frame * each.frames)
    row = {"setting": f"step_s={scene.step_s:.3g}", "failures": 1}
    if scene.step_s > instruments_of(each.body, contact_of(each)).crossing_s:  # it is too fast for such steps
        return row
    try:
        moved, run = each.move(scene, fitted.level % len(each.body.levels))
    except NotConverged:
        return row
    doubt = doubted(run, moved)
    if not np.isfinite(doubt):
        return row
    found = errors(moved.reshape(-1, 3), limit.displacement.reshape(-1, 3)).rmse_of_peak
    felt = force_errors(run.motion.instrument_forces(), limit.force).force_rms_of_peak
    row |= {"force_rms_of_peak": felt, "real_time_factor": run.seconds / each.duration_s}
    return row | {"failures": 0, "rmse_of_peak": found, "estimate_of_peak": doubt, "estimate_s": run.doubt_s}


def measure_held_out(
    input: Any, compared: Compared, grid: dict[str, Any], held_out: int, seed: int, say: Callable
) -> Any:
    """Measure strokes that region_modes were not shown, for the rule of that name."""
    scene = compared.of(body_file.load(input.body))
    progress = steps(say, f"{scene.name}: stroke held out")
    return measure_strokes(scene, stored(Strokes, input.strokes), grid, held_out, seed, progress)
