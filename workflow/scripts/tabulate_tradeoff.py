import pandas as pd

from palpate.evaluation.tradeoff.accuracy_vs_time import accuracy_vs_time
from palpate.evaluation.tradeoff.provenance import commit
from palpate.job import job, write_table

with job(snakemake.log[0]):
    settings = pd.concat([pd.read_csv(path) for path in snakemake.input.settings])
    write_table(accuracy_vs_time(settings, commit()), snakemake.output[0])
