import pandas as pd

from palpate.enrichment.training_samples import FitOptions
from palpate.evaluation.tradeoff.measure_model import measure
from palpate.job import job, steps, write_table
from palpate.models.model_registry import model
from palpate.models.read_case import read_case

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.enrichment, split="contacts", seed=params.seed)
    files = [given.body, given.database, given.compliance, given.split, given.fine, given.coarse]
    case, test, numbers = read_case(*files, wild.regime, params.radius, options, params.tolerance)
    tables = []
    for name in params.models:
        progress = steps(say, f"{wild.body}, {wild.regime}, {name}: setting")
        rest = test, numbers, params.repeats, params.budget, progress
        tables.append(measure(case, name, model(name, params.own), *rest))
    for part, output in zip(
        zip(*tables, strict=True), (snakemake.output.samples, snakemake.output.settings), strict=True
    ):
        write_table(pd.concat(part), output)
