"""Check of the settings of paper 1's enrichment."""

from pathlib import Path

from palpate.errors import InputError, describe_unknown
from palpate.studies.enrichment.premise_samples import sample_counts


def check(config: dict, file: Path) -> None:
    """Raise InputError for what the schema cannot find: an empty range of widths, nothing to sample."""
    sigma = config["enrichment"]["sigma_relative"]
    if sigma["min"] >= sigma["max"]:
        raise InputError(
            f"{file}: enrichment.sigma_relative.min is {sigma['min']}; make it less than max, {sigma['max']}."
        )
    if not any("train" in body for body in config["bodies"].values()):
        raise InputError(f"{file}: enrichment is there and no body has train and test; give a body both.")
    for name, case in config["enrichment"]["premises"]["cases"].items():
        _check_premise(f"{file}: enrichment.premises.cases.{name}", name, case, config["bodies"])
    if twice := sorted(set(config["enrichment"]["regimes"]) & set(config.get("regimes", {}))):
        raise InputError(f"{file}: enrichment.regimes.{twice[0]} is under regimes, too; give it another name.")


def _check_premise(place: str, name: str, case: dict, bodies: dict) -> None:
    """Raise InputError for a premise without a body that is refined, or without whole contacts to hold out."""
    if wrong := describe_unknown([case["body"]], list(bodies)):
        raise InputError(f"{place}.body names {wrong}")
    body = bodies[case["body"]]
    if case.get("direction") is not None and not any(case["direction"]):
        raise InputError(f"{place}.direction is [0, 0, 0], which points nowhere; give one number that is not 0.")
    if "train" in bodies.get(name, {}):
        raise InputError(f"{place} has the name of a body with samples, which is a premise, too; give it another.")
    if not case.get("refinements", body.get("refinements", 0)):
        raise InputError(f"{place}.body names {case['body']}, which is not refined; give refinements of at least 1.")
    sample_counts(place, case, body)
