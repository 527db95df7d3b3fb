from palpate.benchmark.presses import choose_presses
from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table

with job(snakemake.log[0], snakemake.output.warned) as say:
    body, params = load(snakemake.input.body), snakemake.params
    progress = steps(say, f"{body.name}, {snakemake.wildcards.regime}: forces at contact")
    loads = choose_presses(body, params.contacts, params.presses, params.regime, params.radius_m, params.seed, progress)
    write_table(loads, snakemake.output.loads)
