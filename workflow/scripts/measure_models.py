import pandas as pd

from palpate.benchmark.judge import read_judged
from palpate.benchmark.measure import measure, warn_unanswered
from palpate.benchmark.model import FitOptions
from palpate.models.load_model import load_model
from palpate.run.job import job, steps, write_table

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    rest = params.radius_m, options, params.tolerance, params.settings
    case, judge = read_judged(given, wild.regime, int(wild.split), *rest, more=bool(params.more_of))
    tables = []
    for name, recipe in params.models.items():
        progress = steps(say, f"{wild.body}, {wild.regime}, {name}: setting")
        asked = judge, params.repeats, params.budget_s, progress, params.more_of.get(name)
        tables.append(measure(case, name, load_model(name, **recipe), *asked))
        if given.get("own"):
            warn_unanswered(name, tables[-1][1])
    samples, settings = (pd.concat(part) for part in zip(*tables, strict=True))
    write_table(samples, snakemake.output.samples)
    write_table(settings, snakemake.output.settings)
