from palpate.bodies.body_file import load
from palpate.evaluation.tradeoff.limit_points import limit_points
from palpate.job import job, steps, write_table

with job(snakemake.log[0]) as say:
    body, params = load(snakemake.input.body), snakemake.params
    progress = steps(say, f"{body.name}: a growing press at contact")
    write_table(limit_points(body, params.radius_m, params.contacts, progress=progress), snakemake.output[0])
