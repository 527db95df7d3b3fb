from palpate.figures import dynamic_accuracy, style, tables
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(dynamic_accuracy.draw(tables.read(snakemake.input[0])), stem(snakemake.output))
