from palpate.job import job, write_table
from palpate.samples.database import read
from palpate.samples.sample_table import sample_table

with job(snakemake.log[0]):
    params = snakemake.params
    table = sample_table(read(snakemake.input.database), params.train, params.test, params.seed)
    write_table(table, snakemake.output[0])
