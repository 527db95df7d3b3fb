from palpate.bodies.body_file import load as load_body
from palpate.run.job import job, steps, write_table
from palpate.studies.dynamic.dynamic_accuracy import measure
from palpate.studies.dynamic.dynamic_reference import load
from palpate.studies.dynamic.dynamic_trial import trial_and_training

with job(snakemake.log[0]) as say:
    params = snakemake.params
    moving = trial_and_training(body=load_body(snakemake.input.body), **params.trial)
    more = params.trial["own"].get("models", ()), steps(say, f"{moving[0].name}: model")
    write_table(measure(*moving, load(snakemake.input.reference), params.settings, *more), snakemake.output[0])
