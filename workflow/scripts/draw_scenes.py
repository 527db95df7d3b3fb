from palpate.figures import effects_cost, energy, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(energy.draw(tables.read(snakemake.input.energy)), stem(snakemake.output.energy))
    style.save(effects_cost.draw(tables.read(snakemake.input.effects)), stem(snakemake.output.effects))
