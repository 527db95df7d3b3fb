from palpate.evaluation.effect_cost import cost
from palpate.job import job, write_table
from palpate.scenes.cast import cast
from palpate.scenes.scene import scene_of

with job(snakemake.log[0]):
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = cast(scene, snakemake.input.bodies)
    write_table(cost(scene, particles, repeats=3), snakemake.output[0])
