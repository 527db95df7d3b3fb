"""The declared list of hard cases, and the table of their outcomes."""

from collections.abc import Callable

import pandas as pd

from palpate.studies.hard_cases import (
    contact_cases,
    dynamics_cases,
    enrichment_cases,
    fem_cases,
    model_cases,
    nonlinear_cases,
    tissue_cases,
)
from palpate.studies.hard_cases.hard_case import Case, judge

FAMILIES = {
    "enrichment": [enrichment_cases.cases, enrichment_cases.bounds],
    "fem": [
        fem_cases.elasticity,
        fem_cases.statics,
        nonlinear_cases.starts,
        nonlinear_cases.laws,
        tissue_cases.still,
        nonlinear_cases.relaxations,
        model_cases.reduced_contacts,
        model_cases.learnt,
        model_cases.engines,
    ],
    "dynamics": [dynamics_cases.motions, tissue_cases.moving],
    "contact": [contact_cases.overlaps, contact_cases.contacts],
    "organ": [tissue_cases.organs],
}


def declared(families: list[str]) -> list[Case]:
    """Return the cases of some of FAMILIES, in order."""
    return [case for family in families for cases in FAMILIES[family] for case in cases()]


def measure(family: str, progress: Callable = iter) -> pd.DataFrame:
    """Compute the rows of hard_cases.csv: each case of a family with each of its models, by ``judge``.

    ``progress`` wraps the list of cases, as ``tqdm`` does. Every case is run, and no failure stops the others.
    """
    return pd.DataFrame([judge(case, model) for case in progress(declared([family])) for model in case.models])
