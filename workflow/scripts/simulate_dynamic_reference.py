from palpate.bodies.body_file import load
from palpate.run.job import job, write_table
from palpate.studies.dynamic.dynamic_reference import reference, save
from palpate.studies.dynamic.dynamic_trial import trial_and_training
from palpate.studies.dynamic.resolution import tabulate

with job(snakemake.log[0], snakemake.output.warned) as say:
    scene, lesson = trial_and_training(body=load(snakemake.input.body), **snakemake.params.trial)
    own = snakemake.params.trial["own"]
    found = reference(scene, lesson, own["change_of_peak"], own["max_halvings"])
    say(f"{scene.name}: a step of {found.step_s:.2g} s; halving it last changed {found.change:.2%} of the peak")
    write_table(tabulate(scene, found), snakemake.output.table)
    save(found, snakemake.output.reference)
