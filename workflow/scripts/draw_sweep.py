from palpate.figures import style, tables
from palpate.figures.enrichment import sigma_sweep
from palpate.files import read_yaml
from palpate.job import job, stem

with job(snakemake.log[0]):
    paper = read_yaml(snakemake.input.paper)
    sweep, accuracy = tables.read(snakemake.input.sweep), tables.read(snakemake.input.accuracy)
    style.save(sigma_sweep.draw(sweep, accuracy, published=paper), stem(snakemake.output))
