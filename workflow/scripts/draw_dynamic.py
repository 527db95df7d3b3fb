from palpate.figures import style, tables
from palpate.figures.dynamic import dynamic_accuracy
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(dynamic_accuracy.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
