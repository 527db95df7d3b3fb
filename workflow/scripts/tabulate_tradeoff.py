from pathlib import Path

import pandas as pd

from palpate.evaluation.tradeoff.accuracy_vs_time import accuracy_vs_time
from palpate.evaluation.tradeoff.provenance import commit
from palpate.job import job, write_table

with job(snakemake.log[0]):
    settings = pd.concat([pd.read_csv(path) for path in snakemake.input.settings])
    write_table(accuracy_vs_time(settings, commit()), snakemake.output.table)
    samples = pd.concat([pd.read_csv(path) for path in snakemake.input.samples])
    for path in map(Path, snakemake.output.samples):
        body, regime = path.parts[-4:-2]
        wanted = {"body": body, "regime": regime, "model": path.stem}
        write_table(samples[(samples[list(wanted)] == pd.Series(wanted)).all(axis=1)], path)
