"""Functions that the rules of workflow/rules/tradeoff.smk call; palpate.studies.jobs says how."""

from pathlib import Path

import pandas as pd

from palpate.benchmark.truth import load_truth
from palpate.bodies.body_file import load
from palpate.run.job import steps


def _judged(input, params, wildcards, split, grid, more=False):
    """Return a case with its training samples, and the judge of the others."""
    from palpate.benchmark.judge import read_judged
    from palpate.benchmark.model import FitOptions

    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    rest = params.radius_m, options, params.tolerance, grid
    return read_judged(input, wildcards.regime, int(split), *rest, more=more)


def simulate_truth(input, output, params, wildcards, say):
    from palpate.benchmark.split import asked_samples, read_folds, training_presses
    from palpate.benchmark.truth import save_truth, truth_of
    from palpate.studies.tradeoff.truth_table import other_element, widened

    body, loads, folds = load(input.body), pd.read_csv(input.loads), read_folds(input.samples)
    asked, tested = asked_samples(folds, params.splits)
    more = training_presses(folds, params.splits[0]) if params.more else []
    chosen = loads[loads["sample"].isin([*asked, *more])]
    progress = steps(say, f"{body.name}, {wildcards.regime}: truth, solution")
    truth, check = truth_of(body, chosen, set(tested), progress, params.tolerance), pd.DataFrame()
    if params.check_samples:
        progress = steps(say, f"{body.name}, {wildcards.regime}: truth by linear elements, solution")
        check = other_element(body, chosen, truth, truth.spread(params.check_samples), progress)
        truth = widened(truth, check)
    save_truth(truth, output.truth)
    return {"check": check}


def measure_models(input, params, wildcards, say):
    from palpate.benchmark.measure import measure, warn_unanswered
    from palpate.models.load_model import load_model

    case, judge = _judged(input, params, wildcards, wildcards.split, params.settings, bool(params.more_of))
    tables = []
    for name, recipe in params.models.items():
        progress = steps(say, f"{wildcards.body}, {wildcards.regime}, {name}: setting")
        asked = judge, params.repeats, params.budget_s, progress, params.more_of.get(name)
        tables.append(measure(case, name, load_model(name, **recipe), *asked))
        if input.get("own"):
            warn_unanswered(name, tables[-1][1])
    return dict(zip(("samples", "settings"), map(pd.concat, zip(*tables, strict=True)), strict=True))


def measure_bounds(input, params, wildcards):
    from palpate.benchmark.measure import bounds
    from palpate.studies.tradeoff.error_estimates import estimates

    case, judge = _judged(input, params, wildcards, wildcards.split, {}, params.more)
    samples, settings = bounds(case, judge)
    return {"samples": samples, "settings": settings, "estimates": estimates(case, judge, tuple(params.models))}


def measure_facets(input, params, wildcards, say):
    from palpate.bodies.organs import surface_of
    from palpate.studies.tradeoff.truth_table import geometry_share

    body, truth, loads = load(input.body), load_truth(input.truth), pd.read_csv(input.loads)
    progress = steps(say, f"{body.name}, {wildcards.regime}: what its facets change, solution")
    chosen = truth.spread(params.samples)
    return geometry_share(body, surface_of(params.entry), loads, truth, chosen, progress)


def tabulate_truth(input, params):
    from palpate.studies.tradeoff.truth_table import truth_table

    truths = dict(zip(params.scenes, map(load_truth, input.truths), strict=True))
    checks = dict(zip(params.scenes, map(pd.read_csv, input.checks), strict=True)) if input.get("checks") else None
    shares = dict(zip(params.smooth, map(pd.read_csv, input.geometry), strict=True))
    return truth_table(truths, checks, shares)


def tabulate_tradeoff(input):
    from palpate.studies.tradeoff.accuracy_vs_time import accuracy_vs_time, commit

    return accuracy_vs_time(pd.concat([pd.read_csv(path) for path in input.settings]), commit())


def _of(paths, body, regime):
    """Return the files of one body and regime."""
    return [path for path in paths if Path(path).parts[-5:-3] == (body, regime)]


def tabulate_error_bounds(input):
    from palpate.benchmark.error_bounds import SAMPLES, Scene, error_bounds
    from palpate.files import read_table
    from palpate.studies.tradeoff.error_estimates import read_estimates

    scenes = []
    for (body, regime), settings in pd.read_csv(input.table).groupby(["body", "regime"], sort=False):
        errors = pd.concat([read_table(path, SAMPLES)[SAMPLES] for path in _of(input.errors, body, regime)])
        estimates = pd.concat([read_estimates(path) for path in _of(input.estimates, body, regime)])
        scenes.append(Scene(settings, errors, estimates))
    return error_bounds(scenes)


def _advice(table, errors, limits):
    """Advise on each scene of a table, the files of whose samples are ``errors``."""
    from palpate.benchmark.advice import advise
    from palpate.benchmark.ranking import errors_from

    return [
        advise(settings, errors_from(_of(errors, body, regime), settings), **limits)
        for (body, regime), settings in table.groupby(["body", "regime"], sort=False)
    ]


def tabulate_advice(input, params):
    from palpate.benchmark.advice_other_loads import advise_motion

    limits, found = params.limits, []
    pressed = pd.read_csv(input.table[0]) if input.table else None
    if pressed is not None:
        found += _advice(pressed, input.errors, limits)
    bounds = dict(table for path in input.bounds for table in pd.read_csv(path).groupby("scene"))
    for path in input.motions:
        for scene, rows in pd.read_csv(path).groupby("scene", sort=False):
            found.append(advise_motion(rows, **limits, speeds=params.speeds, bounds=bounds.get(scene), pressed=pressed))
    return pd.concat(found)


def tabulate_advice_by_radius(input, params):
    from palpate.benchmark.advice import by_radius
    from palpate.studies.tradeoff.accuracy_vs_time import accuracy_vs_time, commit

    table = accuracy_vs_time(pd.concat([pd.read_csv(path) for path in input.settings]), commit())
    radii = {scene: tuple(place) for scene, place in params.radii.items()}
    return by_radius(pd.concat(_advice(table, input.errors, params.limits)), radii)


def _asked(params):
    """Yield the name, the model and the pattern of settings of each model that is asked."""
    from palpate.models.load_model import load_model

    for name, (recipe, pattern) in params.models.items():
        yield name, load_model(name, **recipe), pattern


def measure_any_load(input, params, wildcards, say):
    from palpate.studies.tradeoff.general_loads import measure_any, questions

    place, found = f"{wildcards.body}, {wildcards.regime}", []
    case, judge = _judged(input, params, wildcards, params.split, params.grid)
    progress = steps(say, f"{place}: answer of the fine operator")
    asked = questions(case, judge, params.samples, params.reference, progress)
    for name, model, pattern in _asked(params):
        rest = params.repeats, params.budget_s, steps(say, f"{place}, {name}: setting")
        found.append(measure_any(case, name, model, pattern, asked, *rest))
    return pd.concat(found)


def measure_beyond_design(input, params, wildcards, say):
    from palpate.studies.tradeoff.general_loads import measure_beyond, presses_beyond

    case, judge = _judged(input, params, wildcards, params.split, params.grid)
    progress = steps(say, f"{wildcards.body}, {wildcards.regime}: contact")
    asked = presses_beyond(case, judge, params.samples, progress)
    return pd.concat([measure_beyond(case, name, model, pattern, asked) for name, model, pattern in _asked(params)])


def tabulate_limit_points(input, params, say):
    from palpate.studies.tradeoff.limit_points import limit_points

    body = load(input.body)
    progress = steps(say, f"{body.name}: a growing press at contact")
    return limit_points(body, params.radius_m, params.contacts, progress=progress)
