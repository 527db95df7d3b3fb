import pandas as pd

from palpate.benchmark.database import read
from palpate.benchmark.model import FitOptions
from palpate.benchmark.split import read_samples, sides
from palpate.run.job import job, write_table
from palpate.studies.enrichment.sigma_sweep import sweep_rows

with job(snakemake.log[0]):
    db, samples = read(snakemake.input.database), read_samples(snakemake.input.samples)
    tables = []
    for protocol, split in snakemake.params.cases:
        options = FitOptions(**snakemake.params.regression, split=split, seed=snakemake.params.seed)
        train, test = sides(samples, split)
        tables.append(sweep_rows(db, train, test, protocol, options, dict(snakemake.wildcards.items())))
    write_table(pd.concat(tables), snakemake.output[0])
