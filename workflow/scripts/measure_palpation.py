from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.palpation.palpation import palpate

with job(snakemake.log[0]) as say:
    body = load(snakemake.input.body)
    progress = steps(say, f"{body.name}: a finger at place")
    write_table(palpate(body, **snakemake.params.settings, progress=progress), snakemake.output[0])
