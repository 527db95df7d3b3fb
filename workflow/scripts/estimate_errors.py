from palpate.benchmark.judge import read_judged
from palpate.benchmark.model import FitOptions
from palpate.run.job import job, write_table
from palpate.studies.tradeoff.error_estimates import estimates

with job(snakemake.log[0]):
    params, wild = snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    rest = params.radius_m, options, params.tolerance, {}
    case, judge = read_judged(snakemake.input, wild.regime, int(wild.split), *rest, more=params.more)
    write_table(estimates(case, judge, tuple(params.models)), snakemake.output[0])
