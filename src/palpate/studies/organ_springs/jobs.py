"""Functions that the rules of workflow/rules/organ_springs.smk call; palpate.studies.jobs says how."""

from palpate.run.job import rarely


def fit_organ_springs(input, params, say):
    import pandas as pd

    from palpate.bodies.body_file import load
    from palpate.studies.organ_springs import organ_fit
    from palpate.studies.organ_springs.organ import mass_motion, organ, references
    from palpate.studies.organ_springs.organ_fit import rivals

    found = organ(load(input.body), params.settings)
    say(f"{found.body.name}: press it with finite elements")
    motions = references(found)
    errors, history = organ_fit.measure(
        found, motions, params.seed, lambda method: rarely(say, f"{method}: how far, best fitness")
    )
    return {
        "organ_springs": pd.concat([errors, rivals(found, motions)]),
        "organ_history": history.assign(body=found.body.name),
        "mass_motion": mass_motion(found),
    }
