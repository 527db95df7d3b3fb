from palpate.figures import scaling, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(scaling.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
