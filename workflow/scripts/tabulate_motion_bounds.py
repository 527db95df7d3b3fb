import pandas as pd

from palpate.run.job import job, write_table
from palpate.studies.dynamic.motion_bounds import motion_bounds

with job(snakemake.log[0]):
    write_table(motion_bounds(pd.read_csv(path) for path in snakemake.input), snakemake.output[0])
