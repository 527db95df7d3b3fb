"""The declared list of hard cases, and the table of their outcomes."""

from collections.abc import Callable
from typing import Any

import pandas as pd

from palpate.run.job import steps
from palpate.studies.hard_cases import (
    contact_cases,
    cut_cases,
    dynamics_cases,
    enrichment_cases,
    fem_cases,
    model_cases,
    nonlinear_cases,
    organ_cases,
    tissue_cases,
    touch_cases,
)
from palpate.studies.hard_cases.stage import Case, judge
from palpate.table_declaration import Table

FAMILIES = {
    "enrichment": [enrichment_cases.cases],
    "fem": [
        fem_cases.elasticity,
        fem_cases.statics,
        nonlinear_cases.starts,
        nonlinear_cases.laws,
        tissue_cases.still,
        nonlinear_cases.relaxations,
        nonlinear_cases.stability,
        model_cases.reduced_contacts,
        model_cases.learnt,
    ],
    "dynamics": [dynamics_cases.motions, tissue_cases.moving, organ_cases.strokes],
    "contact": [contact_cases.overlaps, contact_cases.contacts, touch_cases.cases],
    "organ": [tissue_cases.organs],
    "cuts": [cut_cases.cases],
}
LONG = {
    *("each_law_crushed", "thousandfold_inverting_force", "nearly_incompressible"),
    *("modes_slivers", "modes_load_times_3", "modes_load_times_50", "twisting_10_turns"),
    *("finger_through", "finger_without_friction", "finger_friction_of_2", "finger_in_steps_of_40_ms"),
    *("finger_over_held_rim", "finger_into_held_rim"),
    *("stack_1_to_100", "sheet_folded_on_itself"),
    *("cut_two_that_cross", "cut_organ", "cut_pulled_far", "cut_near_faces", "cut_parallel_to_skin", "cut_near_nodes"),
    *("cut_incompressible", "cut_stops_midway"),
    *("finger_at_speed", "finger_through_in_a_step", "modes_load_times_2", "learnt_at_0.49", "lobe_on_edge_asked"),
    *("column_at_1.4_solved", "post_pushed_to_0.9_asked", "post_pushed_to_1.4_asked", "post_pushed_to_3_asked"),
}
"""Cases that take more than some seconds; shorter cases of their families try the same models."""


def declared(families: list[str], long: bool = True) -> list[Case]:
    """Return the cases of some of FAMILIES, in order; without those of LONG unless ``long``."""
    cases = [case for family in families for make in FAMILIES[family] for case in make()]
    return [case for case in cases if long or case.name not in LONG]


HARD_CASES = Table(
    "hard_cases",
    "The outcome of every model in every situation that is known to be difficult, and the errors of four wrong "
    "answers.",
    """
    family case source scene: a case, who thought of it, and the situation
    model outcome: a model, and what came of it
    measure value bound: meaning of the error, its value, and the bound that was declared
    frozen zero tenth: errors of three wrong answers: of a frozen solver, of no displacement, of a tenth more or less
    twentieth: the same of a twentieth more or less
    sharp: whether the bound fails the first three
    declared passed: acceptable outcomes, and whether this is one
    message: the reason that was given
    """,
)


def measure(family: str, progress: Callable = iter, long: bool = True) -> pd.DataFrame:
    """Compute the rows of hard_cases.csv: each case of ``declared`` with each of its models, by ``judge``.

    ``progress`` wraps the list of cases, as ``tqdm`` does. Every case is run, and no failure stops the others.
    """
    cases = progress(declared([family], long))
    return pd.DataFrame([{"family": family} | judge(case, model) for case in cases for model in case.models])


def try_hard_cases(wildcards: Any, say: Callable, long: bool) -> pd.DataFrame:
    """Try the cases of a family, for the rule of this name; say each outcome that is not as declared."""
    table = measure(wildcards.family, steps(say, f"hard cases of {wildcards.family}:"), long)
    for row in table[~table["passed"]].itertuples():
        outcome = f"{row.case} with {row.model} is {row.outcome}, declared {row.declared}"
        say(f"warning: {outcome}: {row.value} {row.message}")
    return table
