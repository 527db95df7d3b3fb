import pandas as pd

from palpate.benchmark.judge import read_judged
from palpate.benchmark.model import FitOptions
from palpate.models.load_model import load_model
from palpate.run.job import job, steps, write_table
from palpate.studies.tradeoff.beyond_design import measure_beyond, presses_beyond

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    place = f"{wild.body}, {wild.regime}"
    case, judge = read_judged(given, wild.regime, params.split, params.radius_m, options, params.tolerance, params.grid)
    asked = presses_beyond(case, judge, params.samples, steps(say, f"{place}: contact"))
    found = []
    for name, (recipe, pattern) in params.models.items():
        found.append(measure_beyond(case, name, load_model(name, **recipe), pattern, asked))
    write_table(pd.concat(found), snakemake.output[0])
