"""Deal the contacts of a body into folds, and read who trains, who chooses and who is tested in each split."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.errors import InputError
from palpate.files import read_table

FOLDS = 5
"""The number of folds, and so of splits; a body with fewer contacts has as many as it has contacts."""
COLUMNS = ["sample", "contact", "peak_m", "fold"]


def deal(contact: np.ndarray, seed: int, folds: int = FOLDS) -> np.ndarray:
    """Divide the contacts at random into equal folds; return the fold of each sample, (k,), from 1 on.

    contact : (k,) contact node of each sample; all samples of a contact are in one fold
    Raises InputError for fewer than three contacts: one to train on, one to choose settings by, and one to test on.
    """
    nodes, which = np.unique(contact, return_inverse=True)
    if len(nodes) < 3:
        raise InputError(f"tradeoff.contacts: {len(nodes)} contacts are too few to train, choose and test; give 3.")
    dealt = np.empty(len(nodes), dtype=int)
    dealt[np.random.default_rng(seed).permutation(len(nodes))] = np.arange(len(nodes)) % min(folds, len(nodes)) + 1
    return dealt[which]


def fold_table(db: Database, seed: int) -> pd.DataFrame:
    """Return one row for each sample of ``db``: its contact, its peak [m] and its fold; InputError as in ``deal``."""
    columns = {"sample": np.arange(len(db.contact)), "contact": db.contact, "peak_m": db.peaks}
    return pd.DataFrame(columns | {"fold": deal(db.contact, seed)})[COLUMNS]


def read_folds(path: Path | str) -> pd.DataFrame:
    """Read a table that ``fold_table`` made; InputError if it is missing or is no such table."""
    return read_table(path, COLUMNS)


def fold_sides(samples: pd.DataFrame, split: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sample numbers that train, that choose settings (validation), and that test in a ``split`` from 1 on.

    Split s tests on fold s, chooses on the next one (after the last the first), and trains on the others.
    InputError for a split that the samples do not have.
    """
    folds = int(samples["fold"].max())
    if not 1 <= split <= folds:
        raise InputError(f"tradeoff.splits: there is no split {split}; the samples have the splits 1 to {folds}.")
    test, chooses = (samples["fold"] == fold for fold in (split, split % folds + 1))
    return tuple(samples.loc[side, "sample"].to_numpy() for side in (~test & ~chooses, chooses, test))


def training_presses(samples: pd.DataFrame, split: int) -> np.ndarray:
    """Return one sample number for each contact that trains in a ``split``, increasing, of all presses in turn.

    A model that learns nothing errs there as at contacts that nobody has seen.
    """
    train, *_ = fold_sides(samples, split)
    rows = samples.set_index("sample").loc[train].reset_index()
    found = [own["sample"].iloc[i % len(own)] for i, (_, own) in enumerate(rows.groupby("contact", sort=True))]
    return np.sort(np.array(found, dtype=int))


def asked_samples(samples: pd.DataFrame, splits: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the sample numbers that choose or test in any of ``splits``, and those that test, both increasing.

    The truth is needed of the first, and on its finest level of the second.
    """
    sides = [fold_sides(samples, split) for split in splits]
    tested = np.unique(np.concatenate([test for _, _, test in sides]))
    return np.unique(np.concatenate([tested, *(chooses for _, chooses, _ in sides)])), tested
