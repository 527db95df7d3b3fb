"""Functions that the rules of workflow/rules/dynamic.smk call; palpate.studies.jobs says how."""

import pandas as pd

from palpate.bodies.body_file import load
from palpate.run.job import steps


def leave_out_scenes(params):
    import warnings

    for name, reason in params.reasons.items():
        warnings.warn(f"scenes.{name}: models are not compared in it, as it {reason}.", stacklevel=1)


def simulate_dynamic_reference(input, output, params, say):
    from palpate.studies.dynamic.compared_scene import compared_and_training
    from palpate.studies.dynamic.reference import reference, save, tabulate

    scene, lesson = compared_and_training(body=load(input.body), **params.compared)
    own = params.compared["own"]
    found = reference(scene, lesson, own["change_of_peak"], own["max_halvings"])
    say(f"{scene.name}: a step of {found.step_s:.2g} s; halving it last changed {found.change:.2%} of the peak")
    save(found, output.reference)
    return {"table": tabulate(scene, found)}


def measure_dynamic(input, params, say):
    from palpate.studies.dynamic import reference
    from palpate.studies.dynamic.accuracy import measure
    from palpate.studies.dynamic.compared_scene import compared_and_training

    moving = compared_and_training(body=load(input.body), **params.compared)
    more = params.compared["own"].get("models", ()), steps(say, f"{moving[0].name}: model")
    return measure(*moving, reference.load(input.reference), params.settings, *more)


def measure_elsewhere(input, params, say):
    from palpate.studies.dynamic.compared_scene import compared_and_training
    from palpate.studies.dynamic.elsewhere import measure_elsewhere

    scene, _ = compared_and_training(body=load(input.body), **params.compared)
    return measure_elsewhere(scene, params.own, params.settings, params.seed, steps(say, f"{scene.name}: place"))


def tabulate_motion_bounds(input):
    from palpate.studies.dynamic.elsewhere import motion_bounds

    return motion_bounds(pd.read_csv(path) for path in input)
