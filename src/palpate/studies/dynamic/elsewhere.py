"""Measure models at other places of a scene's push and on strokes held out, and bound the errors there.

Bounds are conformal, with places or strokes as the unit.
"""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark import measuring
from palpate.benchmark.accuracy import errors
from palpate.benchmark.conformal import CONSTANT, OWN, bound_row
from palpate.benchmark.motion_truth import MotionTruth, motion_truth
from palpate.benchmark.presses import oblique
from palpate.benchmark.ranking import EXACT
from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.settings import Contact, Push
from palpate.errors import NotConverged
from palpate.files import merge
from palpate.models import strokes
from palpate.solvers.quadratic_motion import Reached
from palpate.studies.dynamic.accuracy import STEP, Motions, Moved, measure, prepared_setting
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.fitted import Fitted, MadeModes
from palpate.studies.dynamic.linear_limit import LinearLimit
from palpate.studies.dynamic.reference import reference
from palpate.studies.dynamic.strokes import Strokes, contact_of, modes_of_strokes
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
MOTION_BOUNDS = Table(
    "motion_bounds",
    "Below what the error of nine motions in ten stays where the push is at another place, and how often it did.",
    """
    scene body model setting estimate: what answers, and what its error is estimated from
    places unresolved failures: other places; those whose reference is not resolved; those without an answer
    rank_correlation error_of_peak bound_factor bound_of_peak sharpness: as in error_bounds, medians over the places
    coverage coverage_low: share of the places held out below their bound, and its low end
    estimate_s: time of an estimate [s]
    """,
    always=False,
)


def motion_bounds(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Tabulate motion_bounds.csv of tables like MOTION_PLACES: a row a scene, model, setting and estimate.

    A bound is a factor times an estimate, as in error_bounds.csv: 1 (``constant``), or the model's estimate of its own
    error (``own``). A motion that failed has an infinite error. Factor and bound are found from all places, coverage
    and sharpness at places held out.
    """
    rows = [row for table in tables for _, scene in table.groupby("scene", sort=False) for row in _of_scene(scene)]
    return MOTION_BOUNDS.frame(rows)


def _of_scene(table: pd.DataFrame) -> list[dict]:
    """Return the rows of motion_bounds.csv of one scene from those of MOTION_PLACES."""
    answered = table.dropna(subset="model")
    unresolved = table["contact"].nunique() - answered["contact"].nunique()
    rows_of_scene = []
    for (model, setting), rows in answered.groupby(["model", "setting"], sort=False):
        if len(rows) < answered["contact"].nunique():  # a step that the reference tried at hard places alone
            continue
        labels = {"scene": rows["scene"].iloc[0], "body": rows["body"].iloc[0], "model": model, "setting": setting}
        failures = int((rows["failures"] > 0).sum())
        labels |= {"places": len(rows), "unresolved": unresolved, "failures": failures}
        errors = rows["rmse_of_peak"] + rows["reference_error"].fillna(0.0)
        errors = errors.where(rows["failures"] == 0, np.inf).to_numpy()
        places = rows["contact"].to_numpy()
        estimates = {CONSTANT: (np.ones(len(rows)), 0.0)}
        estimated = rows["estimate_of_peak"].to_numpy()
        if np.isfinite(estimated[np.isfinite(errors)]).all() and np.isfinite(estimated).any():
            estimates[OWN] = np.maximum(np.nan_to_num(estimated, nan=1.0), EXACT), float(rows["estimate_s"].median())
        for name, (estimate, seconds) in estimates.items():
            row = {"estimate": name, "error_of_peak": np.median(errors), "estimate_s": seconds}
            row |= bound_row(errors, estimate, places)
            rows_of_scene.append(labels | row | {"bound_of_peak": row["bound_factor"] * np.median(estimate)})
    return rows_of_scene


def moved_pushes(
    compared: ComparedScene, count: int, tilts_degrees: Sequence[float], seed: int
) -> dict[int, ComparedScene]:
    """Return, by the node that is pushed, the scene with its only push at ``count`` contacts spread over the surface.

    Forces are as large as the scene's and follow the same course in time. They point inward, tilted by each of
    ``tilts_degrees`` in turn towards a seeded random side.
    """
    contacts, push = kept_contacts(compared.body, count), compared.loads.pushes[0]
    newtons = float(np.linalg.norm(push.force_n))
    side_angles = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(contacts))
    scenes = {}
    fine = compared.body.fine
    for number, (contact, side_angle) in enumerate(zip(contacts, side_angles, strict=True)):
        direction = oblique(fine.normals[contact], tilts_degrees[number % len(tilts_degrees)], side_angle)
        push_there = push.but(at_m=fine.nodes[contact].tolist(), force_n=(newtons * direction).tolist())
        scenes[int(contact)] = replace(compared, loads=compared.loads.but(push=Push(loads=[push_there])))
    return scenes


def measure_places(
    compared: ComparedScene,
    own: Mapping[str, Any],
    grid: Mapping[str, Any],
    seed: int,
    progress: Callable = iter,
    like: MotionTruth | None = None,
) -> pd.DataFrame:
    """Tabulate errors and estimates of models with the push at other places, a row a place, model and step.

    own : the scene's block ``elsewhere``
    grid : as of ``accuracy.measure``; steps are those of ``own``, and looser residuals and the like are left out
    like : the truth of the scene's own motion, if it has one; then the truth at every place is found, too
    A place whose standard is not resolved to the end, or whose truth is not believed, has one row, without a model.
    """
    steps = own["steps_per_frame"]
    grid = dict(grid) | {name: grid[name] | {"steps_per_frame": steps} for name in ("fem_coarse", "moving_modes")}
    grid["fem_coarse"] |= {"tolerances": [], "gaps": []}
    grid["moving_modes"] |= {"tolerances": []}
    made_modes = MadeModes.of(compared, grid["moving_modes"])
    modes_of_scene = made_modes.at(compared, grid["moving_modes"], grid["moving_modes"]["missed"])
    rows = []
    for contact, at_place in progress(list(moved_pushes(compared, own["places"], own["tilts_degrees"], seed).items())):
        try:
            truth = reference(at_place, None, own["change_of_peak"], own["max_halvings"])
            if truth.frames < at_place.frames:
                raise NotConverged(f"{compared.name}: steps at node {contact} are not resolved to the end", [])
            limit = None if like is None else _truth_like(like, at_place)
        except NotConverged:
            rows.append(pd.DataFrame({"scene": [compared.name], "body": compared.body.name, "contact": contact}))
            continue
        # models that need a fit are left out, as nothing was fitted to another place
        names = "fem_coarse", "detail_correction", "moving_modes"
        table = measure(at_place, None, truth, grid, names, limit=limit, made=made_modes, other=modes_of_scene)[0]
        rows.append(table[table["varied"].isin([STEP, "place"])].assign(contact=contact, peak_m=truth.peak))
    return pd.concat(rows, ignore_index=True).reindex(columns=MOTION_PLACES.columns)


def _truth_like(like: MotionTruth, moved: ComparedScene) -> MotionTruth:
    """Find the truth of ``moved``, a scene whose push is elsewhere, by ``like``, the scene's own truth.

    The ratio of convergence of ``like`` is taken over, so that few steps do. NotConverged if it is not believed.
    """
    n_steps = min(each.steps for each in like.tried)
    scene_args = moved.body, moved.placed_loads(), moved.rayleigh, moved.duration_s
    truth = motion_truth(*scene_args, moved.frames, n_steps, like=like)
    if truth.rejected:
        raise NotConverged(f"{moved.name}: no truth that is believed: {truth.rejected}", [])
    return truth


HELD_OUT = 1000
"""Added to the seed of the strokes that modes are learnt from, for those that are held out."""


def measure_strokes(
    compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], count: int, seed: int, progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate errors and doubts of ``region_modes`` on ``count`` strokes held out, a row a stroke and step.

    grid : as for ``modes_of_strokes``; seed : of the strokes ``shown``, which modes are learnt from
    """
    fitted = modes_of_strokes(compared, shown, grid, seed)
    region_args = grid["half_width_m"], count, seed + HELD_OUT
    contacts = strokes.roaming(compared.particles(-1), contact_of(compared), *region_args)
    rows: list[measuring.Row] = []
    for number, contact in enumerate(progress(contacts)):
        scene = stroked(compared, contact)
        rows += measure_stroke(scene, limit_of(scene), fitted, number, grid["steps_per_frame"])
    return MOTION_PLACES.frame(rows)


def stroked(compared: ComparedScene, contact: Contact) -> ComparedScene:
    """Return the scene with another stroke; frames, and so steps, are as long as those of ``compared``."""
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


STEP_S, TOLERANCE = 0.02, 1e-3
"""About the step of quadratic elements on a stroke held out, which is halved once for their limit; its tolerance."""


def limit_of(each: ComparedScene) -> StrokeLimit:
    """Extrapolate the motion of quadratic elements on a stroke from two lengths of steps to steps of no length."""
    fewest = max(1, round(each.duration_s / each.frames / STEP_S))
    try:
        longer, shorter = (_of_elements(each, factor * fewest) for factor in (1, 2))
    except NotConverged:
        return StrokeLimit(np.zeros((0, 0, 3)), np.zeros((0, 0, 3)), np.nan)
    truth, force = ((4.0 * u2 - u1) / 3.0 for u1, u2 in zip(longer, shorter, strict=True))  # their steps are of order 2
    return StrokeLimit(truth, force, errors(shorter[0].reshape(-1, 3), truth.reshape(-1, 3)).rmse_of_peak)


def _of_elements(each: ComparedScene, per_frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (f, n_surface, 3) [m] of quadratic elements at frames' ends, mean forces (f, k, 3) [N].

    NotConverged where they turn inside out, too: such a motion is balanced, and none of tissue.
    """
    contact, surface = contact_of(each), each.body.fine.surface
    motion = strokes.elements_under(each.body, contact, each.rayleigh, strokes.points_of(each.body, [contact]))
    count = each.frames * per_frame
    reached: list[Reached] = []
    for state in motion.touched_steps(each.duration_s / count, count, TOLERANCE):
        if (det := motion.least_det(state.x)) <= 0.0:
            raise NotConverged(f"an element is turned inside out (det F {det:.2g}) after {len(reached) + 1} steps", [])
        reached.append(state)
    moved = np.array([(state.x - motion.rest)[surface] for state in reached[per_frame - 1 :: per_frame]])
    forces = np.array([state.forces for state in reached])
    return moved, forces.reshape(each.frames, per_frame, -1, 3).mean(axis=1)


class HeldOutStrokes(Motions):
    """A stroke held out, beside the limit of quadratic elements on it.

    Doubt is infinite where an instrument goes where nothing was prepared: such a motion has failed.
    """

    def judged(self, i: int, answer: Moved) -> measuring.Row:
        if not np.isfinite(answer.columns["estimate_of_peak"]):
            raise NotConverged("the instrument goes where nothing was prepared", [])
        return super().judged(i, answer)


def measure_stroke(
    each: ComparedScene, limit: StrokeLimit, fitted: Fitted, number: int, tried: Sequence[int]
) -> list[measuring.Row]:
    """Return the rows of a stroke, one for each number of steps in a frame that is ``tried``.

    A stroke that is not found, or too fast for such steps, is a failure. One that elements do not find has no model.
    """
    labels: measuring.Row = {"scene": each.name, "body": each.body.name, "contact": number}
    if not len(limit.displacement):
        return [labels]
    labels |= {"reference": "fem_p2", "reference_change": limit.change}
    labels |= {"peak_m": np.linalg.norm(limit.displacement, axis=2).max()}
    settings = [prepared_setting(each, "region_modes", per_frame * each.frames, fitted, "") for per_frame in tried]
    longest_s = instruments_of(each.body, contact_of(each)).crossing_s
    too_fast = NotConverged("an instrument crosses elements within a step", [])
    settings = [one._replace(solver=too_fast) if one.about["step_s"] > longest_s else one for one in settings]
    rows = measuring.measure(HeldOutStrokes(each, limit.displacement, limit.force), settings, 0, 0.0)[1]
    return [row | labels for row in rows]


def measure_elsewhere(
    body: Body,
    compared: Compared,
    truth: MotionTruth | LinearLimit | None,
    own: dict[str, Any],
    settings: dict[str, Any],
    seed: int,
    progress: Callable,
) -> pd.DataFrame:
    """Measure the models at other places, for the rule of that name."""
    like = truth if isinstance(truth, MotionTruth) and not truth.rejected else None
    return measure_places(compared.of(body), own, settings, seed, progress, like)


def measure_held_out(
    body: Body, compared: Compared, strokes: Strokes, grid: dict[str, Any], held_out: int, seed: int, progress: Callable
) -> pd.DataFrame:
    """Measure strokes that region_modes were not shown, for the rule of that name."""
    return measure_strokes(compared.of(body), strokes, grid, held_out, seed, progress)


def tabulate_dynamic(input: Any, output: Any, left_out: dict[str, str]) -> Any:
    """Gather the tables of all scenes, bound their errors, and warn of those left out, for the rule of that name."""
    for name, reason in left_out.items():
        warnings.warn(f"scenes.{name}: models are not compared in it, as it {reason}.", stacklevel=1)
    merge(input, output)
    places = [pd.read_csv(path).reindex(columns=MOTION_PLACES.columns) for path in input.get("motion_places", [])]
    return {"bounds": motion_bounds(places)} if places else {}
