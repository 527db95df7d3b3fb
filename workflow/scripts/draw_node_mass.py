from palpate.figures import node_mass, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(node_mass.draw(tables.read(snakemake.input.table)), stem(snakemake.output))
