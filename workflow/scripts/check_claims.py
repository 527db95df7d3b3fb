from pathlib import Path

import pandas as pd

from palpate.report.claims import gather
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    tables = {Path(file).stem: pd.read_csv(file) for file in snakemake.input}
    write_table(gather(snakemake.params.places, tables), snakemake.output[0])
