"""Functions that the rules of workflow/rules/law.smk call; palpate.studies.jobs says how."""

from palpate.run.job import steps


def compare_laws(input, params, say):
    from palpate.bodies.body_file import load
    from palpate.studies.law.compare_laws import compare_laws, growing_presses

    body = load(input.body)
    found = steps(say, f"{body.name}: forces of growing presses at contact")
    loads = growing_presses(body, params.contacts, params.depths, params.radius_m, found)
    pressed = steps(say, f"{body.name}: presses under each law, variant")
    return {"table": compare_laws(body, loads, params.laws, params.poissons, pressed)}
