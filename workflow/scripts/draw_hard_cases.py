from palpate.figures import style, tables
from palpate.figures.hard_cases import hard_cases
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(hard_cases.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
