from palpate.benchmark.database import read
from palpate.benchmark.split import sample_table
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    params = snakemake.params
    table = sample_table(read(snakemake.input.database), params.train, params.test, params.seed)
    write_table(table, snakemake.output[0])
