"""Functions that the rules of workflow/rules/palpation.smk call; palpate.studies.jobs says how."""

from palpate.run.job import steps


def measure_palpation(input, params, say):
    from palpate.bodies.body_file import load
    from palpate.studies.palpation.palpation import palpate

    body = load(input.body)
    return palpate(body, **params.settings, progress=steps(say, f"{body.name}: a finger at place"))


def measure_palpation_limits(params, say):
    from palpate.studies.palpation.palpation import palpation_limits

    return palpation_limits(**params.settings, progress=steps(say, "a finger above a ball at depth"))
