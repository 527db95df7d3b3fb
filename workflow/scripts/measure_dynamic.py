from palpate.bodies.body_file import load as load_body
from palpate.evaluation.dynamic.dynamic_accuracy import measure
from palpate.evaluation.dynamic.dynamic_reference import load
from palpate.evaluation.dynamic.dynamic_trial import trial
from palpate.job import job, steps, write_table

with job(snakemake.log[0]) as say:
    params = snakemake.params
    scene = trial(body=load_body(snakemake.input.body), **params.trial)
    table = measure(scene, load(snakemake.input.reference), params.settings, steps(say, f"{scene.name}: model"))
    write_table(table, snakemake.output[0])
