from palpate.evaluation.effect_cost import left_out
from palpate.job import job, steps, write_table
from palpate.scenes import motion
from palpate.scenes.cast import cast
from palpate.scenes.scene import scene_of

with job(snakemake.log[0]) as say:
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = cast(scene, snakemake.input.bodies)
    progress = steps(say, f"{scene.name}: without effect")
    write_table(left_out(scene, particles, motion.load(snakemake.input.motion), progress), snakemake.output[0])
