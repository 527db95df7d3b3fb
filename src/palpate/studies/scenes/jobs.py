"""Functions that the rules of workflow/rules/scenes.smk call; palpate.studies.jobs says how."""

import pandas as pd

from palpate.run.job import stem, steps
from palpate.scenes import motion
from palpate.scenes.scene import load_particles, scene_of


def simulate_scene(input, output, params, wildcards, say):
    from palpate.scenes.run_scene import decisions, run
    from palpate.studies.scenes.measurements import warn_of_gain

    scene = scene_of(wildcards.scene, **params.scene)
    particles = load_particles(scene, input.bodies)
    table = decisions(scene, particles)
    for row in table.itertuples():
        say(f"{scene.name}: {row.effect} {'yes' if row.called else 'no'}; {row.reason}")
    moved = run(scene, particles, steps(say, f"{scene.name}: step")).motion
    warn_of_gain(scene, moved.energy)
    motion.save(moved, output.motion)
    return {"decisions": table}


def measure_effects(input, params, wildcards, say):
    from palpate.studies.scenes.measurements import cost, left_out

    scene = scene_of(wildcards.scene, **params.scene)
    particles = load_particles(scene, input.bodies)
    costs = cost(scene, particles, repeats=3)
    progress = steps(say, f"{scene.name}: without effect")
    errors = left_out(scene, load_particles(scene, input.bodies), motion.load(input.motion), progress)
    return {"cost": costs, "left_out": errors}


def tabulate_scenes(input, output, params):
    from palpate.studies.scenes.measurements import energy_balance

    costs, errors = (pd.concat(map(pd.read_csv, paths)) for paths in (input.costs, input.errors))
    energies = {found.scene: found.energy for found in map(motion.load, input.motions)}
    energy = pd.concat(energies, names=["scene", "frame"]).reset_index("scene")
    return {
        "decisions": pd.concat(map(pd.read_csv, input.decisions)),
        "effects": costs.merge(errors, on=["scene", "effect"], how="left"),
        "energy": energy,
        "balance": energy_balance(energy, params.integrators),
    }


def tabulate_contacts(input):
    from palpate.studies.scenes.contact_force import contact_force

    motions = [motion.load(path) for path in input.motions]
    contacts = pd.concat([m.contacts.assign(scene=m.scene) for m in motions])
    return {"contacts": contacts, "force": pd.concat([contact_force(m) for m in motions])}


def draw_motion(input, output):
    from palpate.report import style
    from palpate.studies.scenes import motion_pictures as pictures

    moved = motion.load(input.motion)
    style.save(pictures.stills(moved, count=6), stem(output.stills))
    pictures.animate(moved, output.animation)
    pictures.write(moved, output.turnable)
    motion.write_series(moved, output.series)
