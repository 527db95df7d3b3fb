from palpate.run.job import job, write_table
from palpate.studies.enrichment.timing import complexity, complexity_rows

with job(snakemake.log[0]):
    measured = complexity(snakemake.params.samples, snakemake.params.seed)
    write_table(complexity_rows(measured), snakemake.output[0])
