from palpate.bodies.body_file import save
from palpate.bodies.make_body import make_body
from palpate.run.job import job

with job(snakemake.log[0], snakemake.output.warned):
    save(make_body(snakemake.wildcards.body, snakemake.params.entry), snakemake.output.body)
