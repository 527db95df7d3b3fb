from palpate.run.job import job, write_table
from palpate.studies.enrichment.complexity import complexity_rows, measure

with job(snakemake.log[0]):
    measured = measure(snakemake.params.samples, snakemake.params.seed)
    write_table(complexity_rows(measured), snakemake.output[0])
