from palpate.evaluation.enrichment.complexity import complexity_rows, measure
from palpate.job import job, write_table

with job(snakemake.log[0]):
    measured = measure(snakemake.params.samples, snakemake.params.seed)
    write_table(complexity_rows(measured), snakemake.output[0])
