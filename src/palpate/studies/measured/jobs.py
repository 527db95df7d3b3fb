"""Functions that the rules of workflow/rules/measured.smk call; palpate.studies.jobs says how."""

from palpate.run.job import steps


def measure_experiment(input, params, wildcards, say):
    from palpate.bodies.body_file import load
    from palpate.studies.measured.experiment import experiment_of
    from palpate.studies.measured.measure import measure

    experiment = experiment_of(wildcards.experiment, params.entry)
    models = steps(say, f"{experiment.name}: model")
    return {"table": measure(experiment, load(input.body), params.models, models)}
