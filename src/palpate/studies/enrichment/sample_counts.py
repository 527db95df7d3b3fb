"""Count the samples of a premise."""

from collections.abc import Mapping
from typing import Any

from palpate.errors import InputError


def sample_counts(place: str, premise: Mapping[str, Any], entry: Mapping[str, Any]) -> tuple[list[float], int, int]:
    """Return magnitudes, train and test of a premise, or those of its body's ``entry``.

    Raises InputError, naming ``place``, if neither has them, or if whole contacts cannot be held out.
    """
    given = {key: premise.get(key, entry.get(key)) for key in ("magnitudes", "train", "test")}
    if missing := [key for key, value in given.items() if value is None]:
        raise InputError(f"{place} lacks {missing[0]}, which its body does not have; give it here.")
    for key in ("train", "test"):
        if given[key] % len(given["magnitudes"]):
            raise InputError(
                f"{place}.{key} is {given[key]}; make it a multiple of the {len(given['magnitudes'])} magnitudes, so "
                "that whole contacts can be held out."
            )
    return given["magnitudes"], given["train"], given["test"]
