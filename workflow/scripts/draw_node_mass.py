from palpate.figures import style, tables
from palpate.figures.ct import node_mass
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(node_mass.draw(tables.read(snakemake.input.table)), stem(snakemake.output))
