from palpate.bodies.body_file import load
from palpate.report import style
from palpate.run.job import job, stem
from palpate.studies.enrichment.figures import bodies

with job(snakemake.log[0]):
    style.save(bodies.draw_mesh_levels([load(path) for path in snakemake.input.bodies]), stem(snakemake.output))
