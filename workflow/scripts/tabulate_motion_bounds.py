import pandas as pd

from palpate.evaluation.dynamic.motion_bounds import motion_bounds
from palpate.job import job, write_table

with job(snakemake.log[0]):
    write_table(motion_bounds(pd.read_csv(path) for path in snakemake.input), snakemake.output[0])
