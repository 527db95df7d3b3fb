from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.tradeoff.limit_points import limit_points

with job(snakemake.log[0]) as say:
    body, params = load(snakemake.input.body), snakemake.params
    progress = steps(say, f"{body.name}: a growing press at contact")
    write_table(limit_points(body, params.radius_m, params.contacts, progress=progress), snakemake.output[0])
