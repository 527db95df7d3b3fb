"""Measure the error of each model's motion in a scene, its own estimate of that error, and its times."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark import measuring
from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Answer
from palpate.benchmark.measuring import Call, Kind, Prepared, Row
from palpate.benchmark.model import checked
from palpate.benchmark.motion_truth import MotionRun, MotionTruth, force_errors
from palpate.bodies.body import Body
from palpate.errors import InputError, NotConverged
from palpate.models.own_model import OwnSolver, own_settings
from palpate.models.reduced_body import ReducedBody
from palpate.models.reduced_motion import ReducedMotion, move
from palpate.own_file import MODEL_GUIDE
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.estimates import MotionEstimate, error_of_step, estimate, estimate_in_modes
from palpate.studies.dynamic.fitted import Fitted, Grid, Settings, corrects, models_of
from palpate.studies.dynamic.forces import DYNAMIC_FORCE, LIMIT, curve
from palpate.studies.dynamic.linear_limit import LinearLimit
from palpate.studies.dynamic.reference import Reference
from palpate.studies.dynamic.strokes import Strokes, stroke_modes
from palpate.table_declaration import Table


class Moved(NamedTuple):
    """A model's motion: displacement (f, n_surface, 3) [m], forces (f, k, 3) [N] of instruments, further columns.

    columns : of MotionEstimate and of the times of steps
    """

    displacement: np.ndarray
    forces: np.ndarray
    columns: Row


STEP = "step"
"""What of a setting varies, of those that differ in the step alone; of others it is the name before the equals sign."""
NO_FORCE = np.empty((0, 0, 3))
"""The forces of a motion that has none."""


class Motions(Kind):
    """The motion of one scene, judged by displacements (f, n_surface, 3) [m] and forces (f, k, 3) [N] of instruments.

    A function that returns ``Moved`` answers. It is called once, as it times its own steps and makes the first
    beforehand.
    """

    warm_up = 0

    def __init__(self, compared: ComparedScene, displacement: np.ndarray, force: np.ndarray):
        super().__init__({"scene": compared.name, "body": compared.body.name}, [{}])
        self._displacement, self._force = displacement, force

    def call(self, solver: Call, i: int) -> Call:
        return solver

    def judged(self, i: int, answer: Moved) -> Row:
        columns = errors(answer.displacement.reshape(-1, 3), self._displacement.reshape(-1, 3))._asdict()
        columns |= force_errors(answer.forces, self._force)._asdict()
        return columns | answer.columns | {"force": answer.forces}

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        return rows[0], []


DYNAMIC_ACCURACY = Table(
    "dynamic_accuracy",
    "The error of each model over a whole scene in motion, and the time that it takes.",
    """
    scene body model setting varied: what moves, and what of a setting is not the usual one
    level nodes step_s steps failures: mesh, step [s], and 1 for a motion that did not reach the end
    rmse_m rmse_of_peak p95_of_peak max_of_peak: errors over all frames and surface nodes [m, peak]
    force_rms_of_peak force_peak_error: of the instruments' force, whose means over a frame are compared: over all
        frames, and of its largest value [of the true peak]; empty where nothing touches or a model tells none
    ms_per_step step_p95_ms step_max_ms real_time_factor: times of a step [ms]: mean, 95th percentile and largest, and
        seconds for a second of motion
    estimate_of_peak estimate_s: what the model says of its own error, and the time that takes; of modes of strokes
        what grows with it and is not its size; empty where it says nothing, as at the longest step of the standard,
        which is compared with steps twice as long
    offline_s: preparation [s]
    reference: what errors are from: "fem_p2", the truth in motion_truth.csv, or "fem_fine", the standard of linear
        elements
    reference_level reference_nodes reference_step_s reference_change: its finest level, and what a shorter step changed
    reference_error: of the truth itself, of the peak; of the standard what linear meshes in motion_truth.csv say
        of its own, until they part, and empty where no others were tried
    reference_force_change reference_force_error: the same of the force
    parted: why no error of a model is known, where such meshes agree at no time
    duration_s resolved_s: of the scene, and of what is compared
    """,
)


def measure(
    compared: ComparedScene,
    training: ComparedScene | None,
    standard: Reference,
    grid: Mapping[str, Grid],
    names: Sequence[str] = (),
    progress: Callable = iter,
    limit: MotionTruth | LinearLimit | None = None,
    strokes: Mapping[str, Strokes] | None = None,
    seed: int = 1,
    own: Mapping[str, str] | None = None,
    **made: Any,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate dynamic_accuracy.csv, a row a model and setting, and dynamic_force.csv, of one scene.

    standard : linear elements in short steps
    limit : the truth that errors are from instead, if it is believed; or linear elements on several meshes, which say
        until when the standard is known, and how well
    training : the motion that models are fitted to, None if none is
    grid : by model, the values to try of its settings: ``dynamic.settings`` of the config
    made : what ``moving_modes`` need not make
    strokes : those that models in modes of strokes are learnt from, by model; models without any are not tried
    seed : of the strokes at whose nodes contact is prepared
    own : files of the user's models that answer a motion, by name
    names : the models to try, all that can do the scene if there is none; progress : wraps them, as ``tqdm`` does
    Columns: failures is also 1 for a model to which nothing could be fitted; times are without preparation. varied is
    what a setting changes: STEP or, at the same step, order, tolerance, gap, or place.
    """
    scene_s = compared.duration_s
    if isinstance(limit, LinearLimit) and limit.until_s:
        standard = standard.until(limit.until_s)
    compared = replace(compared, duration_s=standard.duration_s, frames=standard.frames)
    training = training and replace(training, duration_s=standard.training_s, frames=len(standard.training))
    reference, about = _reference_of(compared, standard, limit, scene_s)
    runs = limit.tried if isinstance(limit, MotionTruth) and not limit.rejected else ()
    simulated = [_motion_of_truth(run, standard.frames, scene_s) for run in runs]
    simulated += [_motion_of_standard(compared, standard, number, scene_s) for number in range(len(standard.tried))]
    all_models = models_of(compared, training, standard.training, grid, **made)
    all_models |= {
        name: partial(stroke_modes, compared, each, grid[name], seed) for name, each in (strokes or {}).items()
    }
    models = {name: each for name, each in all_models.items() if not names or name in names}
    settings = chain(simulated, _settings(compared, models, progress), own_motions(compared, own or {}, seed))
    rows = measuring.measure(Motions(compared, reference.truth, reference.force), settings, 0, 0.0)[1]
    about |= {"duration_s": scene_s, "resolved_s": standard.duration_s}
    forces = _force_curves(compared, str(about["reference"]), reference.force, rows)
    return DYNAMIC_ACCURACY.frame(row | about for row in rows), DYNAMIC_FORCE.frame(forces)


def _reference_of(
    compared: ComparedScene, standard: Reference, limit: MotionTruth | LinearLimit | None, whole_s: float
) -> tuple[Reference, Row]:
    """Return what errors are from, with the truth in place of the standard where it is believed, and its columns."""
    about: Row = {
        "reference": "fem_fine",
        "reference_level": len(compared.body.levels) - 1,
        "reference_nodes": compared.nodes(-1),
        "reference_step_s": standard.step_s,
        "reference_change": standard.change,
        "reference_error": np.nan,
        "reference_force_change": standard.force_change,
        "reference_force_error": np.nan,
        "parted": "",
    }
    if isinstance(limit, LinearLimit):
        about |= limit.described(len(compared.body.levels) - 1)
        if limit.until_s and np.isnan(about["reference_force_error"]):
            standard = replace(standard, force=standard.force[:, :0])
    elif limit is not None and not limit.rejected:
        frames = standard.frames
        standard = replace(standard, truth=limit.displacement[:frames], force=limit.force[:frames])
        about |= limit.described(whole_s)
    return standard, about


def _force_curves(compared: ComparedScene, name: str, true: np.ndarray, rows: list[Row]) -> list[Row]:
    """Return rows of dynamic_force.csv: the ``true`` forces (f, k, 3) [N] of ``name``, and those of all settings."""
    ends_s = compared.duration_s * np.arange(1, compared.frames + 1) / compared.frames
    rows_of_forces = list(curve(compared.name, name, LIMIT, ends_s, true))
    for row in rows if true.size else []:
        rows_of_forces += curve(compared.name, row["model"], row["setting"], ends_s, row.get("force", NO_FORCE))
    return rows_of_forces


def _about(model: str, compared: ComparedScene, level: int, steps: int, step_s: float, varied: str = "") -> Row:
    """Return the columns of a setting; varied : what of it is not the usual one, such as "tolerance=0.1"."""
    about: Row = {"model": model, "setting": f"step_s={step_s:.3g} {varied}".rstrip()}
    about |= {"varied": varied.partition("=")[0] or STEP, "level": level, "nodes": compared.nodes(level)}
    return about | {"step_s": step_s, "steps": steps}


def _settings(
    compared: ComparedScene, models: Mapping[str, Callable[[], Settings]], progress: Callable
) -> Iterator[Prepared]:
    """Yield the prepared settings of ``models``, and the NotConverged of a model to which nothing could be fitted."""
    for name in progress(list(models)):
        try:
            prepared = list(models[name]())
        except NotConverged as failure:  # nothing that was fitted moves like the reference
            about = {"model": name, "setting": "fitted", "varied": STEP, "level": 0, "nodes": compared.nodes(0)}
            yield Prepared(about, failure, np.nan)
            continue
        # of a body with one level the coarse one is the reference's
        model = "fem_fine" if name == "fem_coarse" and len(compared.body.levels) == 1 else name
        yield from (prepared_setting(compared, model, *each) for each in prepared)


def prepared_setting(
    compared: ComparedScene, model: str, steps: int, fitted: Fitted | Prepared, varied: str
) -> Prepared:
    """Return a setting of a model whose solver, called without arguments, moves the body and returns ``Moved``.

    fitted : the model, or a reduced body that was prepared
    """
    step_s = compared.duration_s / steps
    if isinstance(fitted, Fitted):
        about = _about(model, compared, fitted.level % len(compared.body.levels), steps, step_s, varied)
        return Prepared(about, partial(_move_as_scene, compared, steps, fitted), fitted.offline_s)
    about, body = _about(model, compared, -1, steps, step_s, varied), fitted.solver
    if isinstance(body, ReducedBody):
        body.at_rest.check(compared.body)
        elements = body.at_rest.elements
        about |= {"level": elements.level, "nodes": len(elements.rest)}
        body = partial(_move_in_modes, compared, steps, body)
    return fitted._replace(about=about, solver=body)


def _move_as_scene(compared: ComparedScene, steps: int, fitted: Fitted) -> Moved:
    """Run the model's scene in ``steps``; NotConverged as ``ComparedScene.move``."""
    run_of_model = fitted.scene(compared, steps), fitted.level % len(compared.body.levels), fitted.young_pa
    compared.begin(*run_of_model)
    moved, run = compared.move(*run_of_model)
    finish_s = 0.0
    if fitted.finish:
        begin = perf_counter()
        moved = fitted.finish(run.motion)
        finish_s = perf_counter() - begin
    estimated = estimate(compared, fitted, steps, run.motion, moved)
    if run.doubts_m.size:
        peak = np.linalg.norm(moved, axis=2).max()
        estimated = MotionEstimate(float(run.doubts_m.max() / peak), run.doubt_s)
    late_s = finish_s / compared.frames  # of the steps that end a frame
    times = run.seconds + finish_s, run.step_p95_s + late_s, run.step_max_s + late_s
    columns = estimated._asdict() | _columns_of_times(times, steps, compared.duration_s)
    return Moved(moved, run.motion.instrument_forces(), columns)


def _move_in_modes(compared: ComparedScene, steps: int, body: ReducedBody) -> Moved:
    """Move a reduced body in ``steps``; NotConverged as ``move``."""
    motion = ReducedMotion(body, compared.placed_loads(), compared.rayleigh)
    with suppress(NotConverged):  # what a first step compiles or loads is no part of the time
        move(motion, compared.duration_s / steps, 1, 1)
    simulated = move(motion, compared.duration_s, compared.frames, steps)
    columns = estimate_in_modes(compared, motion, simulated)._asdict()
    return Moved(simulated.moved, NO_FORCE, columns | _times_of_steps(simulated.seconds, steps, compared.duration_s))


def own_motions(compared: ComparedScene, own: Mapping[str, str], seed: int) -> Iterator[Prepared]:
    """Yield the prepared settings of the user's models; their mesh is named as the finest, and a frame is a step.

    own : files by the names of models
    """
    of_all = len(compared.body.levels) - 1, compared.frames, compared.duration_s / compared.frames
    for name, place in own.items():
        for setting in own_settings(name, place, "move", compared.body, compared.name, 0.0, seed):
            solver = setting.solver
            if isinstance(solver, OwnSolver):
                solver = partial(_move_by_own, compared, solver)
            yield setting._replace(about=_about(name, compared, *of_all) | setting.about, solver=solver)


def _move_by_own(compared: ComparedScene, solver: OwnSolver) -> Moved:
    """Ask a model of the user's for the frames of a motion, and time each.

    InputError for another number or shape of frames, or of the forces of instruments.
    """
    with suppress(NotConverged):  # what a first frame compiles or loads is no part of the time
        next(solver.frames(compared), None)
    n_surface = len(compared.body.fine.surface) * (1 + len(compared.shifts_m))
    n_tools = len(compared.loads.contact.instruments) if compared.loads.contact else 0
    moved, forces_felt, seconds, begin = [], [], [], perf_counter()
    for frame in islice(solver.frames(compared), compared.frames + 1):
        seconds.append(perf_counter() - begin)
        moved.append(np.array(checked(frame, n_surface, solver.whose), dtype=float))
        if isinstance(frame, Answer) and frame.forces is not None:
            forces_felt.append(np.array(frame.forces))
        begin = perf_counter()
    gave = f"{solver.whose}: move gave"
    if len(moved) != compared.frames:
        raise InputError(f"{gave} too few or too many frames; give {compared.frames}, {MODEL_GUIDE}.")
    if forces_felt and {np.shape(each) for each in forces_felt} != {(n_tools, 3)}:
        raise InputError(f"{gave} other forces than ({n_tools}, 3) [N]; give these, {MODEL_GUIDE}.")
    forces = np.array(forces_felt) if len(forces_felt) == len(moved) else NO_FORCE
    return Moved(np.array(moved), forces, _times_of_steps(np.array(seconds), len(moved), compared.duration_s))


def _motion_of_standard(compared: ComparedScene, standard: Reference, number: int, whole_s: float) -> Prepared:
    """Return, as a prepared setting, the motion that the standard has found in the step of that number.

    Its error is that of the step alone.
    """
    step_s, finest = float(standard.tried_s[number]), len(compared.body.levels) - 1
    steps, displacement = round(whole_s / step_s), standard.tried[number]
    estimated = MotionEstimate()
    if number and corrects(compared):  # the motion in twice the step is known, too
        error_m = error_of_step(standard.tried[number - 1], displacement, compared.fem(steps).integrator)
        peak = np.linalg.norm(displacement, axis=2).max()
        estimated = MotionEstimate(error_m / peak, float(standard.seconds[number - 1]))
    times = standard.seconds[number], standard.step_p95_s[number], standard.step_max_s[number]
    columns = estimated._asdict() | _columns_of_times(times, steps, whole_s)
    answer = Moved(displacement, standard.tried_force[number], columns)
    return Prepared(_about("fem_fine", compared, finest, steps, step_s), lambda: answer, 0.0)


def _motion_of_truth(run: MotionRun, frames: int, whole_s: float) -> Prepared:
    """Return, as a prepared setting, the first ``frames`` of one of the motions that the truth is extrapolated from.

    Its time includes those of the coarser motions that its iterations began with.
    """
    level, step_s = run.level, whole_s / run.steps
    about: Row = {"model": "fem_p2", "setting": f"level={level} step_s={step_s:.3g}", "varied": STEP, "level": level}
    about |= {"nodes": run.nodes, "step_s": step_s, "steps": run.steps}
    columns = _columns_of_times((run.seconds, run.step_p95_s, run.step_max_s), run.steps, whole_s)
    answer = Moved(run.surface[:frames], run.force[:frames], columns)
    return Prepared(about, lambda: answer, 0.0)


def _times_of_steps(seconds: np.ndarray, steps: int, whole_s: float) -> Row:
    """Return the columns of times of a motion of ``whole_s`` [s] from the seconds of each step, or of each frame."""
    return _columns_of_times((seconds.sum(), np.percentile(seconds, 95), seconds.max()), steps, whole_s)


def _columns_of_times(times: Sequence[float], steps: int, whole_s: float) -> Row:
    """Return the columns of times of a motion of ``whole_s`` [s].

    times : [s] of all steps together, of a step at the 95th percentile, and of the longest
    """
    seconds, p95_s, max_s = map(float, times)
    columns = {"ms_per_step": 1e3 * seconds / steps, "step_p95_ms": 1e3 * p95_s, "step_max_ms": 1e3 * max_s}
    return columns | {"real_time_factor": seconds / whole_s}


def measure_dynamic(
    body: Body,
    compared: Compared,
    reference: Reference,
    truth: MotionTruth | LinearLimit | None,
    strokes: list[Strokes],
    stroked: list[str],
    settings: dict[str, Any],
    own: dict[str, str],
    seed: int,
    progress: Callable,
) -> dict[str, pd.DataFrame]:
    """Compare the models in a scene, for the rule of that name."""
    scene, training = compared.and_training(body)
    table, force = measure(
        scene,
        training,
        reference,
        settings,
        names=compared.own.models or (),
        progress=progress,
        limit=truth,
        strokes=dict(zip(stroked, strokes, strict=True)),
        seed=seed,
        own=own,
    )
    return {"table": table.assign(duration_s=compared.scene.duration_s), "force": force}
