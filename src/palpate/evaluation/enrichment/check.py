"""Check of the settings of paper 1's enrichment."""

from pathlib import Path

from palpate.config import check_samples
from palpate.errors import InputError


def check(config: dict, file: Path) -> None:
    """Raise InputError for what the schema cannot find: an empty range of widths, nothing to sample."""
    sigma = config["enrichment"]["sigma_relative"]
    if sigma["min"] >= sigma["max"]:
        raise InputError(
            f"{file}: enrichment.sigma_relative.min is {sigma['min']}; make it less than max, {sigma['max']}."
        )
    check_samples(file, "enrichment", config)
