import pandas as pd

from palpate.bodies.body_file import load
from palpate.bodies.mesh_quality import mesh_quality, mesh_sizes
from palpate.run.job import job, write_table

with job(snakemake.log[0]):
    bodies = [load(path) for path in snakemake.input.bodies]
    paper = snakemake.params.paper
    sizes = pd.concat(mesh_sizes(body, {"paper_surface": paper[body.name]}) for body in bodies)
    write_table(sizes, snakemake.output.sizes)
    write_table(pd.concat(map(mesh_quality, bodies)), snakemake.output.quality)
