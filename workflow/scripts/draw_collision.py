from pathlib import Path

from palpate.figures import style, tables
from palpate.figures.collision import collision, collision_scaling
from palpate.job import job

with job(snakemake.log[0]):
    for figure, path in zip((collision, collision_scaling), snakemake.input, strict=False):
        style.save(figure.draw(tables.read(path)), Path(snakemake.output[0]).with_name(Path(path).stem))
