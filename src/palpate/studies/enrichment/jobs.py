"""Functions that the rules of workflow/rules/enrichment.smk call; palpate.studies.jobs says how."""

from pathlib import Path

import pandas as pd

from palpate.benchmark.database import read
from palpate.benchmark.split import read_samples, sides
from palpate.bodies.body_file import load
from palpate.run.job import stem, steps


def evaluate_methods(input, output, params, wildcards):
    import h5py

    from palpate.benchmark.accuracy import accuracy_rows, predict
    from palpate.benchmark.model import FitOptions
    from palpate.files import write_whole
    from palpate.models.enrichment.methods import build
    from palpate.solvers.compliance import load_compliance
    from palpate.studies.enrichment.sigma_sweep import sweep_rows

    db, compliance, samples = read(input.database), load_compliance(input.compliance), read_samples(input.samples)
    labels, sweeps, tables = dict(wildcards.items()), [], []
    with write_whole(output.predictions) as path, h5py.File(path, "w") as file:
        for protocol, split in params.cases:
            options = FitOptions(**params.regression, split=split, seed=params.seed)
            train, test = sides(samples, split)
            sweeps.append(sweep_rows(db, train, test, protocol, options, labels))
            methods = build(db, compliance, train, protocol, options)
            tables.append(accuracy_rows(db, methods, protocol, test, {**labels, "split": split}))
            for name in params.shown:
                file[f"{protocol}/{split}/{name}/sample"] = test
                file[f"{protocol}/{split}/{name}/predicted"] = predict(db, methods[name], protocol, test)
    return {"sweep": pd.concat(sweeps), "accuracy": pd.concat(tables)}


def compare_premises(input, params, say):
    from palpate.benchmark.model import FitOptions
    from palpate.studies.enrichment.premises import Settings, compare

    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    settings = Settings(**params.settings, options=options)
    databases = {name: read(path) for name, path in zip(params.sampled, input.databases, strict=True)}
    return compare(params.cases, params.bodies, databases, settings, steps(say, "premise"))


def time_methods(input, params, wildcards):
    from palpate.benchmark.model import FitOptions
    from palpate.models.enrichment.methods import build
    from palpate.solvers.compliance import load_compliance
    from palpate.studies.enrichment.timing import choose_samples, cost_table, solves, timing_table

    body, db, compliance = load(input.body), read(input.database), load_compliance(input.compliance)
    train, test = sides(read_samples(input.samples), "samples")
    options = FitOptions(**params.regression, split="samples", seed=params.seed)
    methods = {protocol: build(db, compliance, train, protocol, options) for protocol in ("paper", "live")}
    samples, name, repeats = choose_samples(db.peaks, test), wildcards.body, params.repeats
    loads = pd.read_csv(input.loads).iloc[samples]
    fine, coarse = (solves(body, level, loads, params.tolerance) for level in (len(body.levels) - 1, 0))
    timing = timing_table(db, methods, fine, coarse, samples, name, repeats, params.published_means)
    return {"timing": timing, "cost": cost_table(db, methods, coarse, samples, name, repeats)}


def time_complexity(params):
    from palpate.studies.enrichment.timing import complexity, complexity_rows

    return complexity_rows(complexity(params.samples, params.seed))


def tabulate_samples(input):
    from palpate.benchmark.split import sample_peaks, split_counts
    from palpate.benchmark.static_responses import load_responses

    tables = {Path(path).parts[-3:-1]: read_samples(path) for path in input.samples}
    costs = []
    for path in map(Path, input.fine):
        body, regime = path.parts[-3:-1]
        costs.append(load_responses([path]).costs().assign(body=body, regime=regime))
    columns = ["body", "regime", "sample", "newton_iterations", "linear_solves", "residual", "seconds"]
    return {"peaks": sample_peaks(tables), "splits": split_counts(tables), "cost": pd.concat(costs)[columns]}


def draw_meshes(input, output):
    from palpate.report import style
    from palpate.studies.enrichment.figures import bodies

    style.save(bodies.draw_mesh_levels([load(path) for path in input.bodies]), stem(output))


def draw_responses(input, output):
    from palpate.report import style
    from palpate.studies.enrichment.figures import bodies

    body, db, path = load(input.body), read(input.database), input.predictions
    shown = bodies.read(path, "paper", "samples", bodies.DEFORMED_BY)
    style.save(bodies.draw_deformed_bodies(body, db, shown), stem(output.deformed))
    groups = {
        f"{protocol} protocol, {split} held out": bodies.read(path, protocol, split, bodies.JUDGED)
        for protocol, split in (("paper", "samples"), ("live", "contacts"))
    }
    style.save(bodies.draw_error_over_body(body, db, groups), stem(output.errors))
    bodies.write(db, groups["live protocol, contacts held out"], output.turnable)
