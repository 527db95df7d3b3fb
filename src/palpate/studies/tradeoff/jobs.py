"""Functions that workflow/rules/tradeoff.smk calls; workflow/job.py says how."""

import subprocess
import warnings
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Truth, read_judged
from palpate.benchmark.model import Model
from palpate.benchmark.press_measure import ACCURACY_VS_TIME
from palpate.benchmark.settings import FitOptions
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.bodies.settings import Smooth
from palpate.models.model_registry import SAVED_AGAINST
from palpate.run.job import steps
from palpate.stores import store, stored
from palpate.studies.tradeoff.settings import Advice, Families

TRUTH_TOLERANCE = 1e-3
"""Relative residual on the finest level."""


def simulate_truth(input, output, wildcards, say, splits: list[int], more: bool, check_samples: int):
    """Find the truth of the samples that models are asked for, and check some of them by linear elements."""
    from palpate.benchmark.database import asked_samples, read_folds, training_presses
    from palpate.benchmark.presses import samples_in
    from palpate.benchmark.truth import truth_of
    from palpate.studies.tradeoff.truth_table import other_element, widened

    body, samples, folds = load(input.body), samples_in(pd.read_csv(input.loads)), read_folds(input.samples)
    judged, tested = asked_samples(folds, splits)
    training = training_presses(folds, splits[0]) if more else np.empty(0, dtype=int)
    chosen = [sample for sample in samples if sample.number in {*judged, *training}]
    progress = steps(say, f"{body.name}, {wildcards.regime}: truth, solution")
    truth, check = truth_of(body, chosen, set(tested), progress, TRUTH_TOLERANCE), pd.DataFrame()
    if check_samples:
        progress = steps(say, f"{body.name}, {wildcards.regime}: truth by linear elements, solution")
        check = other_element(body, chosen, truth, truth.spread(check_samples), progress)
        truth = widened(truth, check)
    store(truth, output.truth, compressed=True)
    return {"check": check}


def measure_models(
    input, wildcards, say, options: FitOptions, grid: Families, tolerance: float, radius_m: float, models: dict,
    more_of: dict[str, str], repeats: int, budget_s: float,
):  # fmt: skip
    """Measure all settings of the models of one family on the samples of a split."""
    from palpate.benchmark.press_measure import measure, warn_unanswered

    of_case = wildcards.regime, int(wildcards.split), radius_m, options, tolerance
    case, judge = read_judged(input, *of_case, more=bool(more_of))
    tables = []
    for name, recipe in models.items():
        progress = steps(say, f"{wildcards.body}, {wildcards.regime}, {name}: setting")
        measure_args = judge, repeats, budget_s, progress, more_of.get(name)
        tables.append(measure(case, name, load_model(name, **recipe).tried(case, grid), *measure_args))
        if input.get("own"):
            warn_unanswered(name, tables[-1][1])
    return dict(zip(("samples", "settings"), map(pd.concat, zip(*tables, strict=True)), strict=True))


def load_model(name: str, place: str, fields: dict[str, Any]) -> Model:
    """Load the model ``name``: a class such as "palpate.models.kinds:FEM", or a file whose name ends in ``.py``.

    fields : those of the class that make it this model; a file's has none
    No registry is read, so that whoever measures one model does not depend on the names of the others. InputError for
    whatever is wrong with a file.
    """
    from palpate.models.own_model import load_own

    if place.endswith(".py"):
        return load_own(name, Path(place))
    return resolve_name(place)(**fields)


def measure_bounds(input, wildcards, options: FitOptions, tolerance: float, radius_m: float, more: bool):
    """Tabulate the truth's own errors, those of no displacement, and what errors are estimated from."""
    from palpate.benchmark.press_measure import bounds
    from palpate.studies.tradeoff.error_estimates import estimates

    of_case = wildcards.regime, int(wildcards.split), radius_m, options, tolerance
    case, judge = read_judged(input, *of_case, more=more)
    samples, settings = bounds(case, judge)
    return {"samples": samples, "settings": settings, "estimates": estimates(case, judge)}


def measure_facets(body: Body, loads: pd.DataFrame, truth: Truth, samples: int, entry: Smooth, progress: Callable):
    """Tabulate what the facets of a body change against its smooth surface, on some samples."""
    from palpate.benchmark.presses import samples_in
    from palpate.bodies.organs import surface_of
    from palpate.studies.tradeoff.truth_table import geometry_share

    return geometry_share(body, surface_of(entry), samples_in(loads), truth, truth.spread(samples), progress)


def tabulate_answers(input, scenes: dict[str, tuple[str, float, list[str]]], split: int):
    """Score the answers that engines gave elsewhere, beside palpate's own models."""
    from palpate.benchmark.engine_scores import OWN, score_table
    from palpate.benchmark.ranking import BOUNDS
    from palpate.exchange.judging import score_answers
    from palpate.exchange.presses import of_run
    from palpate.exchange.score import floor_of

    table, parts = pd.read_csv(input.table), []
    for number, (scene, (regime, radius_m, paths)) in enumerate(scenes.items()):
        files = {name: getattr(input, name)[number] for name in ("body", "database", "samples", "truth")}
        questions: Any
        _, questions = of_run(files, regime, split, radius_m)
        rows = table[(table["scene"] == scene) & (table["split"] == split) & ~table["model"].isin(BOUNDS)]
        for path in paths:
            scored = score_answers(Path(path), questions, questions.truth)
            for warning in scored.warnings:
                warnings.warn(warning, stacklevel=1)
            scores = score_table(scored.settings, floor_of(questions.truth), rows)
            parts.append(scores[scores["engine"] != OWN])
    return {"table": pd.concat(parts)}


def _files_of(paths, body, regime):
    """Return those of ``paths`` that are in the folder of one body and regime."""
    return [path for path in paths if Path(path).parts[-5:-3] == (body, regime)]


def tabulate_tradeoff(input, scenes: list[str], smooth: list[str]):
    """Gather the settings of all scenes, bound their errors, and tabulate how exactly truths are known."""
    from palpate.files import read_table
    from palpate.studies.tradeoff.error_bounds import SAMPLES, Scene, error_bounds
    from palpate.studies.tradeoff.error_estimates import read_estimates
    from palpate.studies.tradeoff.truth_table import truth_table

    table, judged = accuracy_vs_time(pd.concat(map(pd.read_csv, input.settings)), commit()), []
    for (body, regime), settings in table.groupby(["body", "regime"], sort=False):
        errors = pd.concat([read_table(path, SAMPLES)[SAMPLES] for path in _files_of(input.errors, body, regime)])
        estimates = pd.concat([read_estimates(path) for path in _files_of(input.estimates, body, regime)])
        judged.append(Scene(settings, errors, estimates))
    truths = dict(zip(scenes, (stored(Truth, path) for path in input.truths), strict=True))
    checks = dict(zip(scenes, map(pd.read_csv, input.checks), strict=True)) if input.checks else None
    shares = dict(zip(smooth, map(pd.read_csv, input.geometry), strict=True))
    return {"table": table, "bounds": error_bounds(judged), "truth": truth_table(truths, checks, shares)}


def _advice(table, errors, limits: Advice):
    """Advise on each scene of a table, the files of whose samples are ``errors``."""
    from palpate.benchmark.advice import advise
    from palpate.benchmark.ranking import errors_from

    return [
        advise(settings, errors_from(_files_of(errors, body, regime), settings), **dict(limits))
        for (body, regime), settings in table.groupby(["body", "regime"], sort=False)
    ]


MOVING = {"budgets_ms": [1, 8, 16.7], "speeds": [1, 20]}
"""Times of a step [ms], of haptics, of a game, and of 60 pictures a second; and multiples of life, for motions."""


def tabulate_advice(input, limits: Advice):
    """Advise on models of presses and of motions."""
    from palpate.benchmark.advice import advise_motion

    advised = []
    pressed = pd.read_csv(input.table[0]) if input.table else None
    if pressed is not None:
        advised += _advice(pressed, input.errors, limits)
    bounds = dict(table for path in input.bounds for table in pd.read_csv(path).groupby("scene"))
    for path in input.motions:
        for scene, rows in pd.read_csv(path).groupby("scene", sort=False):
            advised.append(advise_motion(rows, **dict(limits) | MOVING, bounds=bounds.get(scene), pressed=pressed))
    return pd.concat(advised)


def measure_other_loads(
    input, wildcards, say, options: FitOptions, grid: Families, tolerance: float, radius_m: float, split: int,
    models: dict, samples: int, reference: float, repeats: int, budget_s: float,
):  # fmt: skip
    """Measure models on loads that they were not prepared for, or presses that they were not made for."""
    from palpate.studies.tradeoff.general_loads import measure_any, measure_beyond, presses_beyond, questions

    place, beyond = f"{wildcards.body}, {wildcards.regime}", wildcards.kind == "beyond_design"
    case, judge = read_judged(input, wildcards.regime, split, radius_m, options, tolerance)
    asked_loads: Any
    if beyond:
        asked_loads = presses_beyond(case, judge, samples, steps(say, f"{place}: contact"))
    else:
        progress = steps(say, f"{place}: answer of the fine operator")
        asked_loads = questions(case, judge, samples, reference, progress)
    tables = []
    for name, (recipe, pattern) in models.items():
        of_model = case, name, load_model(name, **recipe).tried(case, grid), pattern, asked_loads
        timing_args = repeats, budget_s, steps(say, f"{place}, {name}: setting")
        tables.append(measure_beyond(*of_model) if beyond else measure_any(*of_model, *timing_args))
    return pd.concat(tables)


def commit() -> str:
    """Return the short commit of this package's source, with a + where files differ from it; or its version."""
    folder = Path(__file__).parents[1]
    words = ["git", "-C", str(folder), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return version("palpate")


def accuracy_vs_time(settings: pd.DataFrame, commit: str) -> pd.DataFrame:
    """Add the commit and break_even_queries to the rows of all settings: after so many the preparation has paid.

    That is offline_s over the time that a query saves against fine FEM in the same split; inf where it saves nothing.
    """
    keys = ["scene", "split"]
    fine_s = settings[settings["model"] == SAVED_AGAINST].groupby(keys)["online_median_s"].last()
    fine_of_row = settings[keys].merge(fine_s.rename("fine"), left_on=keys, right_index=True, how="left")["fine"]
    saved_s = fine_of_row.to_numpy() - settings["online_median_s"].to_numpy()
    queries = np.where(saved_s > 0, settings["offline_s"] / np.where(saved_s > 0, saved_s, 1.0), np.inf)
    return settings.assign(break_even_queries=queries, commit=commit)[ACCURACY_VS_TIME.columns]
