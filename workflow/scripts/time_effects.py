from palpate.run.job import job, write_table
from palpate.scenes.scene import scene_of
from palpate.scenes.scene_bodies import load_particles
from palpate.studies.scenes.measurements import cost

with job(snakemake.log[0]):
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = load_particles(scene, snakemake.input.bodies)
    write_table(cost(scene, particles, repeats=3), snakemake.output[0])
