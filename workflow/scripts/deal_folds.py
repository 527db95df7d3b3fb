from palpate.benchmark.database import read
from palpate.benchmark.split import fold_table
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    write_table(fold_table(read(snakemake.input.database), snakemake.params.seed), snakemake.output[0])
