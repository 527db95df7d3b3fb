"""Tabulate the samples of one body and regime: the contact, the peak and the side of each in both splits."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.benchmark.split import split
from palpate.files import read_table

SPLITS = ("samples", "contacts")
"""What a split holds out: random samples, which is the paper's, or whole contacts."""
COLUMNS = ["sample", "contact", "peak_m", *SPLITS]


def sample_table(db: Database, train: int, test: int, seed: int) -> pd.DataFrame:
    """Return one row for each sample of ``db``: its contact, its peak [m], and "train" or "test" for each of SPLITS.

    InputError if the samples cannot be divided so.
    """
    table = pd.DataFrame({"sample": np.arange(len(db.contact)), "contact": db.contact, "peak_m": db.peaks})
    for kind in SPLITS:
        sides = np.full(len(table), "train", dtype=object)
        sides[split(db.contact, train, test, kind, seed)[1]] = "test"
        table[kind] = sides
    return table[COLUMNS]


def read_samples(path: Path | str) -> pd.DataFrame:
    """Read a table that ``sample_table`` made; InputError if it is missing or is no such table."""
    return read_table(path, COLUMNS)


def sides(samples: pd.DataFrame, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the sample numbers of the training and of the test samples of a split ``kind``."""
    return tuple(samples.loc[samples[kind] == side, "sample"].to_numpy() for side in ("train", "test"))


def sample_peaks(tables: Mapping[tuple[str, str], pd.DataFrame]) -> pd.DataFrame:
    """Return the rows of sample_peaks.csv from the tables of every body and regime."""
    return _joined(tables, lambda table: table[["sample", "peak_m"]])


def split_counts(tables: Mapping[tuple[str, str], pd.DataFrame]) -> pd.DataFrame:
    """Return the rows of splits.csv from the tables of every body and regime: how many samples are on each side."""

    def counted(table: pd.DataFrame) -> pd.DataFrame:
        rows = [[kind, *((table[kind] == side).sum() for side in ("train", "test"))] for kind in SPLITS]
        return pd.DataFrame(rows, columns=["split", "train", "test"])

    return _joined(tables, counted)


def _joined(tables: Mapping[tuple[str, str], pd.DataFrame], part: Callable) -> pd.DataFrame:
    found = [part(table).assign(body=body, regime=regime) for (body, regime), table in tables.items()]
    rows = pd.concat(found)
    return rows[["body", "regime", *rows.columns.drop(["body", "regime"])]]
