import pandas as pd

from palpate.enrichment.training_samples import FitOptions
from palpate.evaluation.tradeoff.measure_model import measure, warn_unanswered
from palpate.job import job, steps, write_table
from palpate.models.load_model import load_model
from palpate.models.read_case import read_case

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    files = given.body, given.database, given.compliance, given.samples
    rest = params.radius_m, options, params.tolerance, {wild.family: params.settings}
    case, test, numbers = read_case(*files, wild.regime, *rest)
    tables = []
    for name, recipe in params.models.items():
        progress = steps(say, f"{wild.body}, {wild.regime}, {name}: setting")
        asked = test, numbers, params.repeats, params.budget_s, progress
        tables.append(measure(case, name, load_model(name, **recipe), *asked))
        if given.get("own"):
            warn_unanswered(name, tables[-1][1])
    samples, settings = (pd.concat(part) for part in zip(*tables, strict=True))
    write_table(samples, snakemake.output.samples)
    write_table(settings, snakemake.output.settings)
