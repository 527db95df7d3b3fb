from palpate.figures import style, tables
from palpate.figures.tradeoff import work_precision
from palpate.job import job, stem

with job(snakemake.log[0]):
    names = ("settings", "advice")
    rows = [tables.where(tables.read(snakemake.input[name]), scene=snakemake.params.scene) for name in names]
    style.save(work_precision.draw(*rows), stem(snakemake.output))
