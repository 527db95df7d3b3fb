from palpate.figures import style, tables
from palpate.figures.scaling import scaling
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(scaling.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
