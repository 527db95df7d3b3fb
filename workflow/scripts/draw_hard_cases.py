from palpate.figures import hard_cases, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(hard_cases.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
