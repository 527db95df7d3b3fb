"""Check of the settings of paper 1's enrichment."""

from pathlib import Path

from palpate.errors import InputError


def check(config: dict, file: Path) -> None:
    """Raise InputError for what the schema cannot find: an empty range of widths, nothing to sample."""
    sigma = config["enrichment"]["sigma_relative"]
    if sigma["min"] >= sigma["max"]:
        raise InputError(
            f"{file}: enrichment.sigma_relative.min is {sigma['min']}; make it less than max, {sigma['max']}."
        )
    if not any("train" in body for body in config["bodies"].values()):
        raise InputError(f"{file}: enrichment is there and no body has train and test; give a body both.")
    if twice := sorted(set(config["enrichment"]["regimes"]) & set(config.get("regimes", {}))):
        raise InputError(f"{file}: enrichment.regimes.{twice[0]} is under regimes, too; give it another name.")
