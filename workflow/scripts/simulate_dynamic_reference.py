from palpate.bodies.body_file import load
from palpate.evaluation.dynamic.dynamic_reference import reference_of_part, save
from palpate.evaluation.dynamic.dynamic_trial import trial
from palpate.job import job

with job(snakemake.log[0], snakemake.output.warned) as say:
    params = snakemake.params
    scene = trial(body=load(snakemake.input.body), **params.trial)
    accuracy = params.change_of_peak, params.training_share, params.max_halvings
    found = reference_of_part(scene, *accuracy, params.shorter)
    say(f"{scene.name}: a step of {found.step_s:.2g} s; halving it last changed {found.change:.2%} of the peak")
    save(found, snakemake.output.reference)
