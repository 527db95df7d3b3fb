from palpate.bodies.make import make_body
from palpate.bodies.store import save
from palpate.job import job

with job(snakemake.log[0]):
    save(make_body(snakemake.wildcards.body, snakemake.params.entry), snakemake.output[0])
