"""What went wrong in any of the comparisons: one table, from whatever tables the report has."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.figures import model_looks, style
from palpate.figures.collision import collision_looks

COLUMNS = ("comparison", "what", "where", "how it failed")


def failures(all_tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Rows of COLUMNS; a table that is not there has none."""
    finders = {
        "enrichment_accuracy": _without_answer,
        "accuracy_vs_time": _failed_samples,
        "dynamic_accuracy": _failed_motions,
        "hard_cases": _hard_cases,
        "collision": _pairs,
    }
    rows = [row for name, find in finders.items() if name in all_tables for row in find(all_tables[name])]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _without_answer(table: pd.DataFrame) -> Iterator[tuple]:
    """Methods without a finite error."""
    for row in table[~np.isfinite(table["rmse_of_peak"])].itertuples():
        where = f"{row.body}, {row.regime} loads, {row.protocol} protocol, {row.split} held out"
        yield "enrichment", style.look(row.method).label, where, "no answer"


def _failed_samples(table: pd.DataFrame) -> Iterator[tuple]:
    """Settings of models that failed on some test samples, or on all."""
    for row in table[table["failures"] > 0].itertuples():
        said = "" if pd.isna(row.failure) else f": {row.failure}"
        told = f"{row.failures} of {row.samples} test samples{said}"
        yield "accuracy and time", model_looks.label(row.model, row.knob), row.scene, told


def _failed_motions(table: pd.DataFrame) -> Iterator[tuple]:
    """Settings of models that did not get through a scene."""
    for row in table[table["failures"] > 0].itertuples():
        yield "models in motion", model_looks.label(row.model, row.knob), row.scene, "did not reach the end"


def _hard_cases(table: pd.DataFrame) -> Iterator[tuple]:
    """Hard cases that did not end in a stable answer."""
    for row in table[table["outcome"] != "stable"].itertuples():
        yield "hard cases", row.model, row.case, row.outcome.replace("_", " ")


def _pairs(table: pd.DataFrame) -> Iterator[tuple]:
    """Structures that missed crossing pairs or made some up."""
    wrong = table[table["missed_pairs"] + table["extra_pairs"] > 0]
    for row in collision_looks.ranked(wrong).itertuples():
        told = f"{int(row.missed_pairs):,} crossing pairs missed, {int(row.extra_pairs):,} made up"
        yield "collision", collision_looks.look(row.structure, row.depths).label, row.scene, told
