import pandas as pd

from palpate.evaluation.tradeoff.advice import advise
from palpate.evaluation.tradeoff.advice_motion import advise_motion
from palpate.evaluation.tradeoff.resampling import read_errors
from palpate.job import job, write_table

with job(snakemake.log[0]):
    table, limits, found = pd.read_csv(snakemake.input.table), snakemake.params.limits, []
    for _, settings in table.groupby("scene", sort=False):
        found.append(advise(settings, read_errors("results/data", settings), **limits))
    for path in snakemake.input.motions:
        found += [advise_motion(rows, **limits) for _, rows in pd.read_csv(path).groupby("scene", sort=False)]
    write_table(pd.concat(found), snakemake.output[0])
