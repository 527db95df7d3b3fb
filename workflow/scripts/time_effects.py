from palpate.run.job import job, write_table
from palpate.scenes.build_system import load_particles
from palpate.scenes.scene import scene_of
from palpate.studies.scenes.effect_cost import cost

with job(snakemake.log[0]):
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = load_particles(scene, snakemake.input.bodies)
    write_table(cost(scene, particles, repeats=3), snakemake.output[0])
