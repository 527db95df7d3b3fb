from palpate.figures import style, tables
from palpate.figures.tradeoff import work_precision
from palpate.job import job, stem

with job(snakemake.log[0]):
    read = [tables.read(snakemake.input[name]) for name in ("settings", "advice")]
    style.save(work_precision.draw(*read, scene=snakemake.params.scene), stem(snakemake.output))
