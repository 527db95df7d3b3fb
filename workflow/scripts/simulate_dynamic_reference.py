from palpate.bodies.body_file import load
from palpate.evaluation.dynamic.dynamic_reference import reference, save
from palpate.evaluation.dynamic.dynamic_trial import trial
from palpate.job import job

with job(snakemake.log[0]) as say:
    params = snakemake.params
    scene = trial(body=load(snakemake.input.body), **params.trial)
    found = reference(scene, params.change_of_peak, params.training_share, params.max_halvings)
    say(f"{scene.name}: a step of {found.step_s:.2g} s; halving it last changed {found.change:.2%} of the peak")
    save(found, snakemake.output[0])
