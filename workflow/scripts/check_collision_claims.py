import pandas as pd

from palpate.evaluation.collision.collision_claims import claims
from palpate.job import job, write_table

with job(snakemake.log[0]):
    write_table(claims(pd.read_csv(snakemake.input[0])), snakemake.output[0])
