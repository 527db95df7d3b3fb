from palpate.bodies.body_file import load
from palpate.figures import style
from palpate.figures.enrichment import mesh_levels
from palpate.job import job, stem

with job(snakemake.log[0]):
    style.save(mesh_levels.draw([load(path) for path in snakemake.input.bodies]), stem(snakemake.output))
