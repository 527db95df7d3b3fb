import pandas as pd

from palpate.benchmark.judge import read_judged
from palpate.benchmark.model import FitOptions
from palpate.models.load_model import load_model
from palpate.run.job import job, steps, write_table
from palpate.studies.tradeoff.any_load import measure_any
from palpate.studies.tradeoff.general_loads import questions

with job(snakemake.log[0]) as say:
    given, params, wild = snakemake.input, snakemake.params, snakemake.wildcards
    options = FitOptions(**params.regression, split="contacts", seed=params.seed)
    place = f"{wild.body}, {wild.regime}"
    case, judge = read_judged(given, wild.regime, params.split, params.radius_m, options, params.tolerance, params.grid)
    asked = questions(
        case, judge, params.samples, params.reference, steps(say, f"{place}: answer of the fine operator")
    )
    found = []
    for name, (recipe, pattern) in params.models.items():
        progress = steps(say, f"{place}, {name}: setting")
        model = load_model(name, **recipe)
        found.append(measure_any(case, name, model, pattern, asked, params.repeats, params.budget_s, progress))
    write_table(pd.concat(found), snakemake.output[0])
