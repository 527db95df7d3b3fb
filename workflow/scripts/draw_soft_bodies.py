from pathlib import Path

from palpate.figures import style, tables
from palpate.figures.shape_matching import body_springs, clusters, integrator_stability, shape_matching_timing
from palpate.job import job

FIGURES = (body_springs, clusters, integrator_stability, shape_matching_timing)

with job(snakemake.log[0]):
    read = {Path(path).stem: tables.read(path) for path in snakemake.input if path.endswith(".csv")}
    for figure in FIGURES:
        name = figure.__name__.rpartition(".")[2]
        style.save(figure.draw(read[name]), Path(snakemake.output[0]).with_name(name))
