from palpate.bodies.body_file import load
from palpate.run.job import job, steps, write_table
from palpate.studies.dynamic.dynamic_trial import trial_and_training
from palpate.studies.dynamic.elsewhere import measure_elsewhere

with job(snakemake.log[0]) as say:
    params = snakemake.params
    scene, _ = trial_and_training(body=load(snakemake.input.body), **params.trial)
    progress = steps(say, f"{scene.name}: place")
    write_table(measure_elsewhere(scene, params.own, params.settings, params.seed, progress), snakemake.output[0])
