from palpate.figures import style, tables
from palpate.figures.scenes import effects, energy
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(energy.draw(tables.read(snakemake.input.energy)), stem(snakemake.output.energy))
    style.save(effects.draw(tables.read(snakemake.input.effects)), stem(snakemake.output.effects))
