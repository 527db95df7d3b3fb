from palpate.benchmark.presses import choose_loads
from palpate.bodies.body_file import load
from palpate.run.job import job, write_table
from palpate.solvers.compliance import load_compliance

with job(snakemake.log[0], snakemake.output.warned):
    params = snakemake.params
    loads = choose_loads(
        load(snakemake.input.body),
        load_compliance(snakemake.input.compliance),
        params.magnitudes,
        params.peak_of_size,
        0.0,
        params.samples,
        params.seed,
    )
    write_table(loads, snakemake.output.loads)
