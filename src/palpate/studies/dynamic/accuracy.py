"""Measure the error of each model's motion, what it says of it itself, and what it costs."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import chain, islice, product
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark import measuring
from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Answer
from palpate.benchmark.measuring import Kind, Prepared, Row
from palpate.benchmark.model import checked
from palpate.benchmark.motion_truth import MotionRun, MotionTruth, force_errors
from palpate.benchmark.timing import Call
from palpate.bodies import body_file
from palpate.bodies.material import LAWS
from palpate.errors import InputError, NotConverged
from palpate.linalg.multigrid import Factor
from palpate.models.fem_statics import to_fine
from palpate.models.load_model import OwnSolver, own_settings
from palpate.models.reduced_body import ReducedBody
from palpate.models.reduced_motion import MotionInModes, ReducedMotion, misses, move
from palpate.own_file import MODEL_GUIDE
from palpate.run.job import steps
from palpate.scenes.motion import Motion
from palpate.scenes.run_scene import compose
from palpate.scenes.scene_check import RELAXED
from palpate.scenes.settings import Scene
from palpate.stores import stored
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.fitted import (
    Fitted,
    corrects,
    fit_correction,
    fit_shapes,
    fit_springs,
    moving_modes,
)
from palpate.studies.dynamic.forces import DYNAMIC_FORCE, LIMIT, curve
from palpate.studies.dynamic.linear_limit import LinearLimit
from palpate.studies.dynamic.reference import Reference, read_truth
from palpate.studies.dynamic.strokes import Strokes
from palpate.studies.dynamic.touching import doubted, tried
from palpate.table_declaration import Table

ORDERS = {"backward_euler": 1, "bdf2": 2, "midpoint": 2}
"""Order of the steps of each integrator whose steps are long enough to matter; explicit ones take far shorter ones."""


class MotionEstimate(NamedTuple):
    """Hold the share of the peak by which a motion may be wrong, empty (NaN) if it is not known, and its time [s]."""

    estimate_of_peak: float = np.nan
    estimate_s: float = np.nan


def estimated(compared: ComparedScene, fitted: Fitted, steps: int, motion: Motion, moved: np.ndarray) -> MotionEstimate:
    """Estimate the error of a model's motion without a reference: √(step² + mesh²).

    motion, moved : of the model in so many ``steps``, and its displacements (f, n_surface, 3) [m]
    The step's part is by how much ``twice_as_long`` changes it, the mesh's part that of ``mesh_residual``, which a
    model on the reference's own mesh does without. There is none where bodies touch, yield or drift, nor for answers
    that are known on the surface alone, nor where iterations end before a step is found: longer steps are wrong alike.
    """
    integrator = fitted.scene(compared, steps).integrator
    if not corrects(compared) or fitted.finish is not None or compared.frames < 2 or integrator in RELAXED:
        return MotionEstimate()
    own = fitted.level % len(compared.body.levels)
    of_step, of_mesh, seconds = 0.0, 0.0, 0.0
    if integrator in ORDERS:
        try:
            of_step, seconds = twice_as_long(compared, fitted, steps, moved)
        except NotConverged:
            return MotionEstimate()
    begin = perf_counter()
    if own < len(compared.body.levels) - 1:
        of_mesh = mesh_residual(compared, own, motion)
    peak = np.linalg.norm(moved, axis=2).max()
    return MotionEstimate(float(np.hypot(of_step, of_mesh) / peak), seconds + perf_counter() - begin)


def twice_as_long(compared: ComparedScene, fitted: Fitted, steps: int, moved: np.ndarray) -> tuple[float, float]:
    """Return ``change_of_step`` [m] of steps twice as long, which meet every second frame, and their time [s]."""
    count = compared.frames // 2
    half = replace(compared, frames=count, duration_s=compared.duration_s * (2 * count) / compared.frames)
    scene = fitted.scene(half, steps // compared.frames * count)
    longer, run = half.move(scene, fitted.level % len(compared.body.levels), fitted.young_pa)
    return change_of_step(longer, moved[1::2][:count], scene.integrator), run.seconds


def change_of_step(longer: np.ndarray, shorter: np.ndarray, integrator: str) -> float:
    """Return the RMSE [m] between motions (f, n, 3) [m] at a step and at half of it, over 2ᵏ − 1 for order k."""
    rms = float(np.sqrt(np.mean(np.sum((longer - shorter) ** 2, axis=2))))
    return rms / (2.0 ** ORDERS[integrator] - 1.0)


def mesh_residual(compared: ComparedScene, level: int, motion: Motion) -> float:
    """Return the RMS [m] over the surface of one Newton step of the fine mesh, at the frame that is deflected most.

    motion : on ``level``, interpolated to the fine mesh, whose forces there, inertia and damping included, do not
    balance; velocities and accelerations are those between frames. Trap: the inertia of swings that are shorter than
    two frames is lost.
    """
    moved = motion.positions - motion.rest
    number = int(np.linalg.norm(moved, axis=2).max(axis=1)[1:-1].argmax()) + 1
    before, here, after = (to_fine(compared.body, level) @ moved[number + side] for side in (-1, 0, 1))
    h = float(motion.times[number + 1] - motion.times[number])
    last = len(compared.body.levels) - 1
    particles = compared.particles(last)
    system = compose(compared.fem(compared.frames), particles)
    system.at(float(motion.times[number]))
    x = particles.nodes + here
    inertia = system.masses[:, None] * (after - 2.0 * here + before) / h**2
    residual = np.where(system.free[:, None], system.force(x, (after - before) / (2.0 * h)) - inertia, 0.0)
    matrix = system.stiffness(x, definite=True)
    assert matrix is not None  # finite elements have one
    system.hold(matrix)
    lacking = Factor(matrix).solve(residual)[compared.body.fine.surface]
    return float(np.sqrt(np.mean(np.sum(lacking**2, axis=1))))


class Moved(NamedTuple):
    """A motion (f, n_surface, 3) [m], forces (f, k, 3) [N] of instruments, and the columns of estimate and times."""

    displacement: np.ndarray
    forces: np.ndarray
    columns: Row


NO_FORCE = np.empty((0, 0, 3))
"""Of a motion that tells no force."""


class Motions(Kind):
    """A motion, asked of a function that returns it: once, as it times its own steps and makes the first beforehand."""

    warm_up = 0

    def __init__(self, compared: ComparedScene, truth: Reference):
        super().__init__({"scene": compared.name, "body": compared.body.name}, [{}])
        self._truth = truth

    def call(self, solver: Call, i: int) -> Call:
        return solver

    def judged(self, i: int, answer: Moved) -> Row:
        found = errors(answer.displacement.reshape(-1, 3), self._truth.truth.reshape(-1, 3))._asdict()
        found |= force_errors(answer.forces, self._truth.force)._asdict()
        return found | answer.columns | {"force": answer.forces}

    def further(self, one: Prepared, rows: list[Row]) -> tuple[Row, list[Row]]:
        return rows[0], []


Grid = Mapping[str, Any]
Tried = Iterator[tuple[int, Fitted | Prepared, str]]
"""Numbers of steps, what takes them, and what of its settings is not the usual one, such as "tolerance=0.1"."""
STEP = "step"
"""What of a setting varies, of those that differ in the step alone; of others it is the name before the equals sign."""


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
    lesson: ComparedScene | None,
    truth: Reference,
    grid: Mapping[str, Grid],
    names: Sequence[str] = (),
    progress: Callable = iter,
    limit: MotionTruth | LinearLimit | None = None,
    strokes: Mapping[str, Strokes] | None = None,
    seed: int = 1,
    own: Mapping[str, str] | None = None,
    **known: Any,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate dynamic_accuracy.csv, a row a model and setting, and dynamic_force.csv.

    truth : the standard; limit : the truth that errors are from instead, where there is one that is believed, or
        linear elements that say until when the standard is known, and how well
    lesson : the motion that models are fitted to, None if none is
    grid : by model, the values to try of its settings: ``dynamic.settings`` of the config
    known : what ``moving_modes`` need not make
    strokes : what models in modes of strokes are learnt from, by their names; without it they are not tried
    seed : of the strokes that say what of a region is in reach
    own : files of the user's models that answer a motion, by name
    names : the models to try, all that can do the scene if there is none; progress : wraps them, as ``tqdm`` does
    Columns: failures is also 1 for a model to which nothing could be fitted; times are without preparation. varied is
    what a setting changes: STEP or, at the same step, order, tolerance, gap, or place.
    """
    whole_s = compared.duration_s
    if isinstance(limit, LinearLimit) and limit.until_s:
        truth = truth.until(limit.until_s)
    compared = replace(compared, duration_s=truth.duration_s, frames=truth.frames)
    lesson = lesson and replace(lesson, duration_s=truth.training_s, frames=len(truth.training))
    found: dict[str, Any] = {
        "reference": "fem_fine",
        "reference_level": len(compared.body.levels) - 1,
        "reference_nodes": compared.nodes(-1),
        "reference_step_s": truth.step_s,
        "reference_change": truth.change,
        "reference_error": np.nan,
        "reference_force_change": truth.force_change,
        "reference_force_error": np.nan,
        "parted": "",
    }
    at_hand: list[Prepared] = []
    if isinstance(limit, LinearLimit):
        found |= limit.described(len(compared.body.levels) - 1)
        if limit.until_s and np.isnan(found["reference_force_error"]):
            truth = replace(truth, force=truth.force[:, :0])
    elif limit is not None and not limit.rejected:
        truth = replace(truth, truth=limit.displacement[: truth.frames], force=limit.force[: truth.frames])
        found |= limit.described(whole_s)
        at_hand = [_quadratic(each, truth, whole_s) for each in limit.tried]
    at_hand += [_tried(compared, truth, number, whole_s) for number in range(len(truth.tried))]
    able = _models(compared, lesson, truth, grid, known)
    able |= {name: partial(tried, compared, shown, grid[name], seed) for name, shown in (strokes or {}).items()}
    models = {name: each for name, each in able.items() if not names or name in names}
    settings = chain(at_hand, _settings(compared, models, progress), own_motions(compared, own or {}, seed))
    rows = measuring.measure(Motions(compared, truth), settings, 0, 0.0)[1]
    ends = truth.duration_s * np.arange(1, truth.frames + 1) / truth.frames
    forces = list(curve(compared.name, str(found["reference"]), LIMIT, ends, truth.force))
    for row in rows:
        felt = row.get("force", truth.force[:0])
        forces += curve(compared.name, row["model"], row["setting"], ends, felt if truth.force.size else felt[:0])
    found |= {"duration_s": whole_s, "resolved_s": truth.duration_s}
    return DYNAMIC_ACCURACY.frame(row | found for row in rows), DYNAMIC_FORCE.frame(forces)


def _settings(
    compared: ComparedScene, models: Mapping[str, Callable[[], Tried]], progress: Callable
) -> Iterator[Prepared]:
    """Yield all settings of ``models``, and a failure for a model of which nothing could be fitted."""
    for name in progress(list(models)):
        try:
            found = list(models[name]())
        except NotConverged as failure:  # nothing that was fitted moves like the reference
            about = {"model": name, "setting": "fitted", "varied": STEP, "level": 0, "nodes": compared.nodes(0)}
            yield Prepared(about, failure, np.nan)
            continue
        # of a body with one level the coarse one is the reference's
        said = "fem_fine" if name == "fem_coarse" and len(compared.body.levels) == 1 else name
        yield from (ready(compared, said, *each) for each in found)


def _models(
    compared: ComparedScene,
    lesson: ComparedScene | None,
    truth: Reference,
    grid: Mapping[str, Grid],
    known: dict[str, Any],
) -> dict[str, Callable[[], Tried]]:
    """Return the models that can do a scene: springs have no plasticity, and those of a sheet no volume.

    What relaxes elements one by one has the corotational law.
    """
    found: dict[str, Callable[[], Tried]] = {"fem_coarse": partial(_coarse, compared, grid["fem_coarse"])}
    if len(compared.body.levels) > 1:
        found["fem_fine"] = partial(_fine, compared, grid["fem_fine"])
    if compared.thickness_m or compared.body.material.law == LAWS[0]:
        found |= {name: partial(_relaxed, compared, name, tried) for name, tried in grid.get("relaxed", {}).items()}
    if corrects(compared):
        found["detail_correction"] = partial(_corrected, compared, grid["fem_coarse"])
        found["moving_modes"] = partial(moving_modes, compared, lesson, grid["moving_modes"], **known)
    if not lesson:
        return found
    learnt = lesson, truth.training
    if not compared.loads.plasticity:
        found["springs"] = partial(_springs, compared, *learnt, False, grid["springs"])
        if not compared.thickness_m:
            found["springs_volume"] = partial(_springs, compared, *learnt, True, grid["springs"])
    return found | {"shape_matching": partial(_shapes, compared, *learnt, grid["shape_matching"])}


def _coarse(compared: ComparedScene, grid: Grid) -> Tried:
    """Yield steps of finite elements on the coarse level, then looser residuals and other gaps at the middle one."""
    counts, elements = grid["steps_per_frame"], Fitted(ComparedScene.fem, compared.body.material.young_pa, 0.0)
    if len(compared.body.levels) > 1:
        for count in counts:
            yield count * compared.frames, elements, ""
    middle = counts[len(counts) // 2] * compared.frames
    if compared.order > 1:
        yield middle, replace(elements, scene=partial(ComparedScene.fem, order=1)), "order=1"
    for loose in grid["tolerances"]:
        yield middle, replace(elements, scene=partial(_looser, loose)), f"tolerance={loose:g}"
    for factor in grid["gaps"] if compared.loads.contact else []:
        yield middle, replace(elements, scene=partial(_wider, factor)), f"gap={factor:g}×"


def _fine(compared: ComparedScene, grid: Grid) -> Tried:
    """Yield the reference's own elements as competitors: at looser residuals, and by steps of first order.

    Those with its own residuals need no run: they are the steps that the reference tried.
    """
    counts = grid["steps_per_frame"]
    elements = Fitted(ComparedScene.fem, compared.body.material.young_pa, 0.0, level=-1)
    for count, loose in product(counts, grid["tolerances"]):
        yield count * compared.frames, replace(elements, scene=partial(_looser, loose)), f"tolerance={loose:g}"
    if compared.order > 1:
        yield min(counts) * compared.frames, replace(elements, scene=partial(ComparedScene.fem, order=1)), "order=1"


def _corrected(compared: ComparedScene, grid: Grid) -> Tried:
    """Yield the same steps of the coarse level, corrected."""
    fitted = fit_correction(compared)
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fitted, ""


def _relaxed(compared: ComparedScene, method: str, tried: Sequence[dict]) -> Tried:
    """Yield settings of a method that relaxes elements one by one, on levels that the body has."""
    for each in tried:
        setting = {name: value for name, value in each.items() if name not in ("level", "steps_per_frame")}
        if each["level"] < len(compared.body.levels):
            scene = partial(ComparedScene.relaxed, method=method, setting=setting)
            elements = Fitted(scene, compared.body.material.young_pa, 0.0, level=each["level"])
            said = " ".join(f"{name}={value}" for name, value in (setting | {"level": each["level"]}).items())
            yield each["steps_per_frame"] * compared.frames, elements, said


def _looser(tolerance: float, compared: ComparedScene, steps: int) -> Scene:
    return compared.fem(steps).model_copy(update={"tolerance": tolerance})  # looser than a scene may be


def _wider(factor: float, compared: ComparedScene, steps: int) -> Scene:
    return compared.widen(factor).fem(steps)


def _springs(compared: ComparedScene, lesson: ComparedScene, wanted: np.ndarray, volume: bool, grid: Grid) -> Tried:
    shares = grid["shares_of_stable_step"]
    fitted = fit_springs(lesson, wanted, volume, max(shares), grid["evaluations"])
    limit = compared.limit_s(fitted.scene(compared, compared.frames), fitted.young_pa)
    for share in shares:
        yield compared.steps(share * limit), fitted, ""


def _shapes(compared: ComparedScene, lesson: ComparedScene, wanted: np.ndarray, grid: Grid) -> Tried:
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fit_shapes(lesson, wanted, count, grid["evaluations"]), ""


def _about(model: str, compared: ComparedScene, level: int, steps: int, step_s: float, varied: str = "") -> Row:
    """Name a setting, of which ``varied`` is not the usual one."""
    about: Row = {"model": model, "setting": f"step_s={step_s:.3g} {varied}".rstrip()}
    about |= {"varied": varied.partition("=")[0] or STEP, "level": level, "nodes": compared.nodes(level)}
    return about | {"step_s": step_s, "steps": steps}


def ready(compared: ComparedScene, model: str, steps: int, fitted: Fitted | Prepared, varied: str) -> Prepared:
    """Return what moves the body of a scene in ``steps``, and says how large its error may be."""
    step_s = compared.duration_s / steps
    if isinstance(fitted, Fitted):
        about = _about(model, compared, fitted.level % len(compared.body.levels), steps, step_s, varied)
        return Prepared(about, partial(_moved, compared, steps, fitted), fitted.offline_s)
    about, body = _about(model, compared, -1, steps, step_s, varied), fitted.solver
    if isinstance(body, ReducedBody):
        body.at_rest.check(compared.body)
        elements = body.at_rest.elements
        about |= {"level": elements.level, "nodes": len(elements.rest)}
        body = partial(_moved_in_modes, compared, steps, body)
    return fitted._replace(about=about, solver=body)


def _moved(compared: ComparedScene, steps: int, fitted: Fitted) -> Moved:
    """Move the body as a scene; NotConverged as ``ComparedScene.move``."""
    of_model = fitted.scene(compared, steps), fitted.level % len(compared.body.levels), fitted.young_pa
    compared.begin(*of_model)
    moved, run = compared.move(*of_model)
    spent = 0.0
    if fitted.finish:
        begin = perf_counter()
        moved = fitted.finish(run.motion)
        spent = perf_counter() - begin
    told = estimated(compared, fitted, steps, run.motion, moved)
    if run.doubts_m.size:
        told = MotionEstimate(doubted(run, moved), run.doubt_s)
    late = spent / compared.frames  # of the steps that end a frame
    taken = run.seconds + spent, run.step_p95_s + late, run.step_max_s + late
    times = _times(taken, steps, compared.duration_s)
    return Moved(moved, run.motion.instrument_forces(), told._asdict() | times)


def _moved_in_modes(compared: ComparedScene, steps: int, body: ReducedBody) -> Moved:
    """Move a reduced body; NotConverged as ``move``."""
    motion = ReducedMotion(body, compared.placed_loads(), compared.rayleigh)
    with suppress(NotConverged):  # what a first step compiles or loads is no part of the time
        move(motion, compared.duration_s / steps, 1, 1)
    found = move(motion, compared.duration_s, compared.frames, steps)
    told = told_in_modes(compared, motion, found)._asdict()
    return Moved(found.moved, NO_FORCE, told | _taken(found.seconds, steps, compared.duration_s))


def own_motions(compared: ComparedScene, own: Mapping[str, str], seed: int) -> Iterator[Prepared]:
    """Yield the settings of models of the user's: their mesh counts as the finest one, and a frame as a step."""
    of_all = len(compared.body.levels) - 1, compared.frames, compared.duration_s / compared.frames
    for name, place in own.items():
        for one in own_settings(name, place, "move", compared.body, compared.name, 0.0, seed):
            solver = one.solver
            if isinstance(solver, OwnSolver):
                solver = partial(_moved_by_own, compared, solver)
            yield one._replace(about=_about(name, compared, *of_all) | one.about, solver=solver)


def _moved_by_own(compared: ComparedScene, solver: OwnSolver) -> Moved:
    """Ask frame by frame; InputError for another number or shape of them, or of forces of instruments."""
    with suppress(NotConverged):  # what a first frame compiles or loads is no part of the time
        next(solver.frames(compared), None)
    n_surface = len(compared.body.fine.surface) * (1 + len(compared.shifts_m))
    touching = len(compared.loads.contact.instruments) if compared.loads.contact else 0
    moved, felt, seconds, begin = [], [], [], perf_counter()
    for frame in islice(solver.frames(compared), compared.frames + 1):
        seconds.append(perf_counter() - begin)
        moved.append(np.array(checked(frame, n_surface, solver.whose), dtype=float))
        if isinstance(frame, Answer) and frame.forces is not None:
            felt.append(np.array(frame.forces))
        begin = perf_counter()
    gave = f"{solver.whose}: move gave"
    if len(moved) != compared.frames:
        raise InputError(f"{gave} too few or too many frames; give {compared.frames}, {MODEL_GUIDE}.")
    if felt and {np.shape(each) for each in felt} != {(touching, 3)}:
        raise InputError(f"{gave} other forces than ({touching}, 3) [N]; give these, {MODEL_GUIDE}.")
    forces = np.array(felt) if len(felt) == len(moved) else NO_FORCE
    return Moved(np.array(moved), forces, _taken(np.array(seconds), len(moved), compared.duration_s))


def told_in_modes(compared: ComparedScene, motion: ReducedMotion, found: MotionInModes) -> MotionEstimate:
    """Estimate the error of a motion in modes: of its step as ``estimated``, and of what ``misses`` finds.

    There is none where steps twice as long are not found.
    """
    begin, count = perf_counter(), compared.frames // 2
    peak = np.linalg.norm(found.moved, axis=2).max()
    if not count:
        return MotionEstimate()
    until = 2 * count * compared.duration_s / compared.frames
    try:
        longer = move(motion, until, count, len(found.reached) // compared.frames * count).moved
    except NotConverged:
        return MotionEstimate()
    of_step = change_of_step(longer, found.moved[1::2][:count], "midpoint")
    return MotionEstimate(float(np.hypot(of_step, misses(motion, found)) / peak), perf_counter() - begin)


def _tried(compared: ComparedScene, truth: Reference, number: int, whole_s: float) -> Prepared:
    """Take the reference at one of its steps, as it is: its error is that of the step alone."""
    step_s, last = float(truth.tried_s[number]), len(compared.body.levels) - 1
    steps = round(whole_s / step_s)
    told = MotionEstimate()
    if number and corrects(compared):  # the run at twice the step is there already
        off = change_of_step(truth.tried[number - 1], truth.tried[number], compared.fem(steps).integrator)
        peak = np.linalg.norm(truth.tried[number], axis=2).max()
        told = MotionEstimate(off / peak, float(truth.seconds[number - 1]))
    taken = truth.seconds[number], truth.step_p95_s[number], truth.step_max_s[number]
    columns = told._asdict() | _times(taken, steps, whole_s)
    moved = Moved(truth.tried[number], truth.tried_force[number], columns)
    return Prepared(_about("fem_fine", compared, last, steps, step_s), lambda: moved, 0.0)


def _quadratic(tried: MotionRun, truth: Reference, whole_s: float) -> Prepared:
    """Take a motion that the limit is made of, as it is; its time includes those of the coarser ones it began with."""
    level, step_s = tried.level, whole_s / tried.steps
    about: Row = {"model": "fem_p2", "setting": f"level={level} step_s={step_s:.3g}", "varied": STEP, "level": level}
    about |= {"nodes": tried.nodes, "step_s": step_s, "steps": tried.steps}
    taken, there = (tried.seconds, tried.step_p95_s, tried.step_max_s), slice(truth.frames)
    moved = Moved(tried.surface[there], tried.force[there], _times(taken, tried.steps, whole_s))
    return Prepared(about, lambda: moved, 0.0)


def _taken(seconds: np.ndarray, steps: int, whole_s: float) -> Row:
    """Return what a motion of ``whole_s`` [s] took, of the times of its steps [s]."""
    return _times((seconds.sum(), np.percentile(seconds, 95), seconds.max()), steps, whole_s)


def _times(taken: Sequence[float], steps: int, whole_s: float) -> Row:
    """Return what a motion of ``whole_s`` [s] took.

    taken : times [s] of all steps together, of a step at the 95th percentile, and of the longest
    """
    seconds, p95_s, max_s = map(float, taken)
    found = {"ms_per_step": 1e3 * seconds / steps, "step_p95_ms": 1e3 * p95_s, "step_max_ms": 1e3 * max_s}
    return found | {"real_time_factor": seconds / whole_s}


def measure_dynamic(
    input: Any,
    compared: Compared,
    stroked: list[str],
    settings: dict[str, Any],
    own: dict[str, str],
    seed: int,
    say: Callable,
) -> Any:
    """Compare the models in a scene, for the rule of that name."""
    moving = compared.and_training(body_file.load(input.body))
    more = compared.own.models or (), steps(say, f"{moving[0].name}: model")
    limit = read_truth(input.truth) if input.truth else None
    shown = {name: stored(Strokes, path) for name, path in zip(stroked, input.strokes, strict=True)}
    reference = stored(Reference, input.reference)
    table, force = measure(*moving, reference, settings, *more, limit, shown, seed, own)
    return {"table": table.assign(duration_s=compared.scene.duration_s), "force": force}
