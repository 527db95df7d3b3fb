from palpate.bodies.make import make_body
from palpate.bodies.store import save
from palpate.job import job

with job(snakemake.log[0]):
    entry = dict(snakemake.params.entry)
    if snakemake.input.mesh:
        entry["path"] = snakemake.input.mesh
    save(make_body(snakemake.wildcards.body, entry), snakemake.output[0])
