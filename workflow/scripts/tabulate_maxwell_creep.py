from palpate.run.job import job, write_table
from palpate.scenes.build_system import load_particles
from palpate.scenes.motion import load
from palpate.scenes.scene import scene_of
from palpate.studies.shape_matching.maxwell_creep import measure

with job(snakemake.log[0]):
    scene = scene_of(snakemake.params.name, snakemake.params.entry)
    particles = load_particles(scene, snakemake.input.bodies)
    write_table(measure(scene, particles, load(snakemake.input.motion)), snakemake.output[0])
