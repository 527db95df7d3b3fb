from palpate.run.job import job, steps, write_table
from palpate.scenes import motion
from palpate.scenes.scene import scene_of
from palpate.scenes.scene_bodies import load_particles
from palpate.studies.scenes.measurements import left_out

with job(snakemake.log[0]) as say:
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = load_particles(scene, snakemake.input.bodies)
    progress = steps(say, f"{scene.name}: without effect")
    write_table(left_out(scene, particles, motion.load(snakemake.input.motion), progress), snakemake.output[0])
