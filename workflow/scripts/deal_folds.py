from palpate.job import job, write_table
from palpate.samples.database import read
from palpate.samples.folds import fold_table

with job(snakemake.log[0]):
    write_table(fold_table(read(snakemake.input.database), snakemake.params.seed), snakemake.output[0])
