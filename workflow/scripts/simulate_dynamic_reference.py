from palpate.bodies.body_file import load
from palpate.evaluation.dynamic.dynamic_reference import reference, save
from palpate.evaluation.dynamic.dynamic_trial import trial
from palpate.job import job

with job(snakemake.log[0]) as say:
    scene = trial(body=load(snakemake.input.body), **snakemake.params.trial)
    found = reference(scene, snakemake.params.change)
    say(f"{scene.name}: a step of {found.step_s:.2g} s; halving it last changed {found.change:.2%} of the peak")
    save(found, snakemake.output[0])
