"""The declared list: every hard case, and the table of what became of it."""

from collections.abc import Callable

import pandas as pd

from palpate.evaluation.hard_cases import contact_cases, dynamics_cases, fem_cases, kernel_cases, start_cases
from palpate.evaluation.hard_cases.hard_case import Case, judge

FAMILIES = {
    "kernel": [kernel_cases.cases],
    "fem": [fem_cases.cases, start_cases.cases],
    "dynamics": [dynamics_cases.cases],
    "contact": [contact_cases.cases],
}


def declared(families: list[str]) -> list[Case]:
    """The cases of some of FAMILIES, in order."""
    return [case for family in families for cases in FAMILIES[family] for case in cases()]


def measure(family: str, progress: Callable = iter) -> pd.DataFrame:
    """Rows of hard_cases.csv: each case of a family with each of its models, as ``judge`` has it.

    ``progress`` wraps the list of cases, as ``tqdm`` does. No case is left out, and none ends the run.
    """
    return pd.DataFrame([judge(case, model) for case in progress(declared([family])) for model in case.models])
