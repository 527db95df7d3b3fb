"""Tabulate what paper 1 claims about features in every premise of the settings, and in the study's own samples."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.benchmark.model import FitOptions
from palpate.studies.enrichment.database_memory import memory_rows
from palpate.studies.enrichment.premise_samples import prepare
from palpate.studies.enrichment.premises import growing_errors, moved_share, split_errors, summarise
from palpate.studies.enrichment.pressed_alike import feature_rows
from palpate.studies.enrichment.sample_counts import sample_counts


class Settings(NamedTuple):
    """Settings that all premises share.

    splits : how many; training_shares : of the contacts, below 1, with which errors are measured again
    peak_of_size : largest displacement of a press of magnitude 1, as a share of the body's longest side
    """

    splits: int
    training_shares: list[float]
    peak_of_size: float
    options: FitOptions


def compare(
    premises: Mapping[str, Mapping[str, Any]],
    bodies: Mapping[str, Mapping[str, Any]],
    databases: Mapping[str, Database],
    settings: Settings,
    progress: Callable = iter,
) -> dict[str, pd.DataFrame]:
    """Return TABLES by name.

    bodies : entries of the settings by name, with magnitudes, train and test where paper 1 has samples of them
    databases : by body, nonlinear samples of the study, which are a premise of their own, named after the body
    progress : wraps the sequence of names, as ``tqdm`` does
    """
    found: dict[str, list[pd.DataFrame]] = {name: [] for name in TABLES}
    for name in progress([*databases, *premises]):
        if name in premises:
            tables = _linear(name, premises[name], bodies[premises[name]["body"]], settings)
        else:
            tables = _nonlinear(name, databases[name], bodies[name], settings)
        for table, rows in tables.items():
            found[table].append(rows.assign(premise=name))
    joined = {name: pd.concat(rows) for name, rows in found.items()}
    return {name: table[["premise", *table.columns.drop("premise")]] for name, table in joined.items()}


TABLES = ("premises", "premise_bodies", "feature_vectors", "database_memory")


def _linear(name: str, premise: Mapping[str, Any], entry: Mapping[str, Any], settings: Settings) -> dict:
    """Return the tables of a premise with linear responses; each split presses other contacts."""
    magnitudes, *counts = sample_counts(f"enrichment.premises.cases.{name}", premise, entry)
    prepared = prepare(name, premise, {key: value for key, value in entry.items() if key not in SAMPLED})
    peak_m = settings.peak_of_size * prepared.body.fine.size
    contacts, seed = sum(counts) // len(magnitudes), settings.options.seed
    drawn = [prepared.database(contacts, magnitudes, peak_m, seed + number) for number in range(settings.splits)]
    every = prepared.database(len(prepared.contacts), [1.0], peak_m, seed)
    held = "as the body" if not {"anchors", "bed"} & set(premise) else "otherwise"
    about = [premise["body"], "linear", premise["made_of"], held, len(every.contact), moved_share(every.fine)]
    return {
        "premises": _summary(drawn, counts, settings),
        "premise_bodies": pd.DataFrame([about], columns=ABOUT),
        "feature_vectors": feature_rows(every, settings.options.neighbours),
        "database_memory": memory_rows(drawn[0], np.arange(counts[0]), settings.options),
    }


def _nonlinear(name: str, db: Database, entry: Mapping[str, Any], settings: Settings) -> dict:
    """Return the tables of the study's own samples; each split holds out others."""
    counts = (entry["train"], entry["test"])
    about = [name, "nonlinear", "solid", "as the body", len(np.unique(db.contact)), moved_share(db.fine)]
    return {
        "premises": _summary([db] * settings.splits, counts, settings),
        "premise_bodies": pd.DataFrame([about], columns=ABOUT),
        "feature_vectors": feature_rows(db, settings.options.neighbours),
        "database_memory": memory_rows(db, np.arange(counts[0]), settings.options),
    }


def _summary(databases: Sequence[Database], counts: Sequence[int], settings: Settings) -> pd.DataFrame:
    """Average the errors of one split of each database."""
    train, test = counts
    errors: list[pd.DataFrame] = []
    for number, db in enumerate(databases):
        errors += split_errors(db, (train, test), number, settings.options)
        errors += growing_errors(db, (train, test), number, settings.options, settings.training_shares)
    return summarise(pd.concat(errors))


ABOUT = ["body", "responses", "made_of", "held", "contacts", "moved_share"]
SAMPLED = ("magnitudes", "train", "test", "paper_surface")
"""Keys of a body's entry that say how it is sampled, and not what it is."""
