"""The declared list of hard cases, and the table of their outcomes."""

from collections.abc import Callable

import pandas as pd

from palpate.studies.hard_cases import (
    bound_cases,
    contact_cases,
    contact_mode_cases,
    dynamics_cases,
    engine_cases,
    enrichment_cases,
    fem_cases,
    law_cases,
    learnt_cases,
    organ_cases,
    overlap_cases,
    relaxed_cases,
    start_cases,
    static_cases,
    tissue_cases,
)
from palpate.studies.hard_cases.hard_case import Case, judge

FAMILIES = {
    "enrichment": [enrichment_cases.cases, bound_cases.cases],
    "fem": [
        fem_cases.cases,
        static_cases.cases,
        start_cases.cases,
        law_cases.cases,
        tissue_cases.still,
        relaxed_cases.cases,
        contact_mode_cases.cases,
        learnt_cases.cases,
        engine_cases.cases,
    ],
    "dynamics": [dynamics_cases.cases, tissue_cases.moving],
    "contact": [overlap_cases.cases, contact_cases.cases],
    "organ": [organ_cases.cases],
}


def declared(families: list[str]) -> list[Case]:
    """Return the cases of some of FAMILIES, in order."""
    return [case for family in families for cases in FAMILIES[family] for case in cases()]


def measure(family: str, progress: Callable = iter) -> pd.DataFrame:
    """Compute the rows of hard_cases.csv: each case of a family with each of its models, by ``judge``.

    ``progress`` wraps the list of cases, as ``tqdm`` does. Every case is run, and no failure stops the others.
    """
    return pd.DataFrame([judge(case, model) for case in progress(declared([family])) for model in case.models])
