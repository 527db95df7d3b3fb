"""Judge what papers claim: one row a claim, with the premise that it was tested in."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import NamedTuple

import numpy as np
import pandas as pd

CONFIRMED = "confirmed"
REFUTED = "refuted"
CONFIRMED_OUTSIDE = "confirmed outside its premise"
REFUTED_OUTSIDE = "refuted outside its premise"
BOUND = "true as a bound"
NOT_TESTABLE = "not testable"  # followed by a colon and the reason


class Claim(NamedTuple):
    """A row of claims.csv."""

    paper: int
    section: str  # "4, figure 4"
    claim: str
    premise: str  # of this test: body, loads, split
    published: str
    ours: str
    verdict: str


def claims(*tables: str):
    """Declare a function of studies/<study>/claims.py that yields the claims that some tables judge.

    tables : their names, literal; the function gets them by name, and is called by runs that make all of them
    """
    return lambda judge: judge


def verdict(holds: bool, within: bool = True) -> str:
    """Return the verdict on a claim; ``within`` says whether it was tested within its premise."""
    if within:
        return CONFIRMED if holds else REFUTED
    return CONFIRMED_OUTSIDE if holds else REFUTED_OUTSIDE


def geometric_mean(values: pd.Series) -> float:
    """Return the mean of positive values that are compared by their ratios; those that are missing do not count."""
    return float(np.exp(np.log(values).mean()))


def not_testable(why: str) -> str:
    """Return the verdict on a claim that this project cannot test."""
    return f"{NOT_TESTABLE}: {why}"


def gather(places: Mapping[str, Sequence[str]], tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Tabulate claims.csv: what functions judge, by paper and in the order of the functions, and their study.

    places : "palpate.studies.<study>.claims:function", and the names of the tables that it gets
    """
    rows = []
    for place, names in places.items():
        study = place.partition(":")[0].split(".")[-2]
        rows += [(*claim, study) for claim in resolve_name(place)({name: tables[name] for name in names})]
    claims = pd.DataFrame(rows, columns=[*Claim._fields, "study"])
    return claims.sort_values("paper", kind="stable", ignore_index=True)


def check_claims(input: Iterable[str], places: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """Judge the claims by the files of tables, for the rule of this name."""
    return gather(places, {Path(file).stem: pd.read_csv(file) for file in input})
