from palpate.enrichment.training_samples import FitOptions
from palpate.evaluation.tradeoff.reference_error import reference_error
from palpate.job import job, steps, write_table
from palpate.models.read_case import read_case

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    files = given.body, given.database, None, given.samples
    case, test, numbers = read_case(*files, wild.regime, params.radius_m, options, params.tolerance, {})
    progress = steps(say, f"{wild.body}, {wild.regime}, one level finer: sample")
    samples, settings = reference_error(case, test, numbers, params.reference_samples, params.tolerance, progress)
    write_table(samples, snakemake.output.samples)
    write_table(settings, snakemake.output.settings)
