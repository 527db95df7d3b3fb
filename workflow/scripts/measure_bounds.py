from palpate.benchmark.judge import read_judged
from palpate.benchmark.measure import bounds
from palpate.benchmark.model import FitOptions
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    params, wild = snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    rest = params.radius_m, options, params.tolerance, {}
    samples, settings = bounds(*read_judged(snakemake.input, wild.regime, int(wild.split), *rest))
    write_table(samples, snakemake.output.samples)
    write_table(settings, snakemake.output.settings)
