from palpate.bodies.store import load
from palpate.figures import mesh_levels, style
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(mesh_levels.draw([load(path) for path in snakemake.input.bodies]), stem(snakemake.output))
