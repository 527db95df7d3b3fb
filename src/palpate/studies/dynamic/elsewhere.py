"""Push a body at other places than its scene does, and bound the errors there: conformal, with places as the unit."""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import CONSTANT, OWN, Draws, bound_factor, finite
from palpate.benchmark.motion_truth import MotionTruth, motion_truth
from palpate.benchmark.presses import oblique
from palpate.benchmark.ranking import EXACT
from palpate.bodies import body_file
from palpate.bodies.contacts import kept_contacts
from palpate.effects.settings import Push
from palpate.errors import NotConverged
from palpate.files import merge
from palpate.run.job import steps
from palpate.studies.dynamic.accuracy import STEP, measure
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.fitted import MadeModes
from palpate.studies.dynamic.reference import read_truth, reference
from palpate.studies.dynamic.touching import MOTION_PLACES
from palpate.table_declaration import Table

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

    A bound is a factor times the estimate, as in error_bounds.csv: nothing (``constant``), or what the model says of
    its own motion (``own``). A motion that failed has an infinite error. Factor and bound are of all places; coverage
    and sharpness are those at places held out.
    """
    rows = [row for table in tables for _, scene in table.groupby("scene", sort=False) for row in _of_scene(scene)]
    return MOTION_BOUNDS.frame(rows)


def _of_scene(table: pd.DataFrame) -> list[dict]:
    from scipy.stats import spearmanr  # it takes most of a second

    known = table.dropna(subset="model")
    unresolved = table["contact"].nunique() - known["contact"].nunique()
    found = []
    for (model, setting), rows in known.groupby(["model", "setting"], sort=False):
        if len(rows) < known["contact"].nunique():  # the reference's last halvings, which the hard places alone have
            continue
        labels = {"scene": rows["scene"].iloc[0], "body": rows["body"].iloc[0], "model": model, "setting": setting}
        failures = int((rows["failures"] > 0).sum())
        labels |= {"places": len(rows), "unresolved": unresolved, "failures": failures}
        errors = rows["rmse_of_peak"] + rows["reference_error"].fillna(0.0)
        errors = errors.where(rows["failures"] == 0, np.inf).to_numpy()
        place = rows["contact"].to_numpy()
        draws = Draws(place)
        values = {CONSTANT: (np.ones(len(rows)), 0.0)}
        told = rows["estimate_of_peak"].to_numpy()
        if np.isfinite(told[np.isfinite(errors)]).all() and np.isfinite(told).any():
            values[OWN] = np.maximum(np.nan_to_num(told, nan=1.0), EXACT), float(rows["estimate_s"].median())
        for name, (value, seconds) in values.items():
            factor = finite(bound_factor(errors / value, place))
            told = {"estimate": name, "rank_correlation": np.nan, "error_of_peak": np.median(errors)}
            if np.ptp(value) > 0 and np.unique(errors).size > 1:
                told["rank_correlation"] = float(spearmanr(errors, value).statistic)
            told |= {"bound_factor": factor, "bound_of_peak": factor * np.median(value), "estimate_s": seconds}
            with np.errstate(invalid="ignore"):  # how sharp an infinite bound of a failure is
                kept = draws.coverage(errors, value)
            told |= {key: getattr(kept, key) for key in ("sharpness", "coverage", "coverage_low")}
            found.append(labels | told)
    return found


def moved_pushes(
    compared: ComparedScene, count: int, tilts_degrees: Sequence[float], seed: int
) -> dict[int, ComparedScene]:
    """Return, by the node that is pushed, scenes that differ in place and direction of their only push.

    Places are ``count`` contacts spread over the surface; forces are as large as the scene's and follow the same
    course, inward, tilted by one of ``tilts_degrees`` after the other towards a seeded random side.
    """
    contacts, push = kept_contacts(compared.body, count), compared.loads.pushes[0]
    newtons = float(np.linalg.norm(push.force_n))
    sides = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(contacts))
    found = {}
    fine = compared.body.fine
    for number, (contact, side) in enumerate(zip(contacts, sides, strict=True)):
        along = oblique(fine.normals[contact], tilts_degrees[number % len(tilts_degrees)], side)
        there = push.but(at_m=fine.nodes[contact].tolist(), force_n=(newtons * along).tolist())
        found[int(contact)] = replace(compared, loads=compared.loads.but(push=Push(loads=[there])))
    return found


def measure_places(
    compared: ComparedScene,
    own: Mapping[str, Any],
    grid: Mapping[str, Any],
    seed: int,
    progress: Callable = iter,
    like: MotionTruth | None = None,
) -> pd.DataFrame:
    """Tabulate errors and estimates of models at other places, a row a place, model and setting of the step.

    own : the scene's block ``elsewhere``
    grid : as for ``dynamic_accuracy.measure``, with the steps of ``own``; looser residuals and the like are left out
    like : the truth of the scene's own motion, if there is one; then there is one of every place
    A place whose reference is not resolved to the end, or whose truth is not believed, has one row, without a model.
    """
    steps = own["steps_per_frame"]
    grid = dict(grid) | {name: grid[name] | {"steps_per_frame": steps} for name in ("fem_coarse", "moving_modes")}
    grid["fem_coarse"] |= {"tolerances": [], "gaps": []}
    grid["moving_modes"] |= {"tolerances": []}
    made = MadeModes.of(compared, grid["moving_modes"])
    modes_of_scene = made.at(compared, grid["moving_modes"], grid["moving_modes"]["missed"])
    rows = []
    for contact, moved in progress(list(moved_pushes(compared, own["places"], own["tilts_degrees"], seed).items())):
        try:
            truth = reference(moved, None, own["change_of_peak"], own["max_halvings"])
            if truth.frames < moved.frames:
                raise NotConverged(f"{compared.name}: steps at node {contact} are not resolved to the end", [])
            limit = None if like is None else _truth_like(like, moved)
        except NotConverged:
            rows.append(pd.DataFrame({"scene": [compared.name], "body": compared.body.name, "contact": contact}))
            continue
        # beside the reference's own steps; nothing was fitted to another place
        names = "fem_coarse", "detail_correction", "moving_modes"
        table = measure(moved, None, truth, grid, names, limit=limit, made=made, other=modes_of_scene)[0]
        rows.append(table[table["varied"].isin([STEP, "place"])].assign(contact=contact, peak_m=truth.peak))
    return pd.concat(rows, ignore_index=True).reindex(columns=MOTION_PLACES.columns)


def _truth_like(like: MotionTruth, moved: ComparedScene) -> MotionTruth:
    """Find the truth where the push is elsewhere; NotConverged if it is not believed."""
    count = min(each.steps for each in like.tried)
    acts = moved.body, moved.placed_loads(), moved.rayleigh, moved.duration_s
    found = motion_truth(*acts, moved.frames, count, like=like)
    if found.rejected:
        raise NotConverged(f"{moved.name}: no truth that is believed: {found.rejected}", [])
    return found


def measure_elsewhere(
    input: Any, compared: Compared, own: dict[str, Any], settings: dict[str, Any], seed: int, say: Callable
) -> Any:
    """Measure the models at other places, for the rule of that name."""
    scene = compared.of(body_file.load(input.body))
    found = read_truth(input.truth) if input.truth else None
    like = found if isinstance(found, MotionTruth) and not found.rejected else None
    progress = steps(say, f"{scene.name}: place")
    return measure_places(scene, own, settings, seed, progress, like)


def tabulate_dynamic(input: Any, output: Any, left_out: dict[str, str]) -> Any:
    """Gather the tables of all scenes, bound their errors, and warn of those left out, for the rule of that name."""
    for name, reason in left_out.items():
        warnings.warn(f"scenes.{name}: models are not compared in it, as it {reason}.", stacklevel=1)
    merge(input, output)
    places = [pd.read_csv(path).reindex(columns=MOTION_PLACES.columns) for path in input.get("motion_places", [])]
    return {"bounds": motion_bounds(places)} if places else {}
