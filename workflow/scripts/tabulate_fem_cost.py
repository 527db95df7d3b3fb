from pathlib import Path

import pandas as pd

from palpate.benchmark.static_responses import load_responses
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    tables = []
    for path in map(Path, snakemake.input.fine):
        body, regime = path.parts[-3:-1]
        tables.append(load_responses([path]).costs().assign(body=body, regime=regime))
    columns = ["body", "regime", "sample", "newton_iterations", "linear_solves", "residual", "seconds"]
    write_table(pd.concat(tables)[columns], snakemake.output[0])
