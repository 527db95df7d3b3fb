from palpate.run.job import job, steps, write_table
from palpate.scenes import motion
from palpate.scenes.build_system import decisions
from palpate.scenes.run_scene import run
from palpate.scenes.scene import scene_of
from palpate.scenes.scene_bodies import load_particles
from palpate.studies.scenes.measurements import warn_of_gain

with job(snakemake.log[0], snakemake.output.warned) as say:
    scene = scene_of(snakemake.wildcards.scene, **snakemake.params.scene)
    particles = load_particles(scene, snakemake.input.bodies)
    table = decisions(scene, particles)
    for row in table.itertuples():
        say(f"{scene.name}: {row.effect} {'yes' if row.called else 'no'}; {row.reason}")
    moved = run(scene, particles, steps(say, f"{scene.name}: step")).motion
    warn_of_gain(scene, moved.energy)
    motion.save(moved, snakemake.output.motion)
    write_table(table, snakemake.output.decisions)
