from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.measured.experiment import experiment_of
from palpate.studies.measured.measure import measure

with job(snakemake.log[0], snakemake.output.warned) as say:
    params = snakemake.params
    experiment = experiment_of(snakemake.wildcards.experiment, params.entry)
    body = load(snakemake.input.body)
    models = steps(say, f"{experiment.name}: model")
    write_table(measure(experiment, body, params.models, models), snakemake.output.table)
