import pandas as pd

from palpate.run.job import job, write_table
from palpate.studies.tradeoff.accuracy_vs_time import accuracy_vs_time
from palpate.studies.tradeoff.provenance import commit

with job(snakemake.log[0]):
    settings = pd.concat([pd.read_csv(path) for path in snakemake.input.settings])
    write_table(accuracy_vs_time(settings, commit()), snakemake.output[0])
