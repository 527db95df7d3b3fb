from palpate.enrichment.training_samples import Settings
from palpate.evaluation.tradeoff.reference_error import own_error
from palpate.job import job, steps, write_table
from palpate.models.read_case import read_case

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    settings = Settings(**params.enrichment, split="contacts", seed=params.seed)
    files = [given.body, given.database, None, given.split, given.fine, given.coarse]
    case, test, numbers = read_case(*files, wild.regime, params.radius, settings, params.tolerance)
    progress = steps(say, f"{wild.body}, {wild.regime}, one level finer: sample")
    samples, knobs = own_error(case, test, numbers, params.samples, params.tolerance, progress)
    write_table(samples, snakemake.output.samples)
    write_table(knobs, snakemake.output.knobs)
