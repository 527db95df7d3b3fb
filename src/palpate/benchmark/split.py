"""Split samples into those for training, choosing settings and testing: as paper 1 does, and by folds of contacts."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.errors import InputError
from palpate.files import read_table


def split(contact: np.ndarray, train: int, test: int, kind: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Split k samples at random into ``train`` and ``test`` ones; return the increasing sample numbers of both.

    contact : (k,) contact node of each sample, k = train + test
    kind : "samples" tests random samples, as the paper; "contacts" all samples of random contacts
    Raises InputError for an empty side, counts that do not add up to k, and counts that no set of whole contacts has.
    """
    k = len(contact)
    if train < 1 or test < 1:
        raise InputError(f"split: train {train} and test {test} must both be at least 1.")
    if train + test != k:
        raise InputError(f"split: train {train} and test {test} must add up to the {k} samples there are.")
    random = np.random.default_rng(seed)
    if kind == "samples":
        order = random.permutation(k)
        return np.sort(order[test:]), np.sort(order[:test])
    if kind != "contacts":
        raise InputError(f"split: kind {kind!r} is unknown; use samples or contacts.")
    held_out = np.isin(contact, _contacts_with(contact, test, random))
    return np.flatnonzero(~held_out), np.flatnonzero(held_out)


def _contacts_with(contact: np.ndarray, wanted_count: int, random: np.random.Generator) -> np.ndarray:
    """Choose random contacts with exactly ``wanted_count`` samples in all, by dynamic programming over sums."""
    nodes, counts = np.unique(contact, return_counts=True)
    reached: dict[int, list[int]] = {0: []}
    for i in random.permutation(len(nodes)):
        for total in sorted(reached, reverse=True):
            larger = total + counts[i]
            if larger <= wanted_count and larger not in reached:
                reached[larger] = [*reached[total], i]
    if wanted_count not in reached:
        raise InputError(
            f"split: no set of whole contacts has {wanted_count} test samples; make test a multiple of those."
        )
    return nodes[reached[wanted_count]]


FOLDS = 5
"""The number of folds, and so of splits; a body with fewer contacts has as many as it has contacts."""
FOLD_COLUMNS = ["sample", "contact", "peak_m", "fold"]


def deal(contact: np.ndarray, seed: int) -> np.ndarray:
    """Deal the contacts at random into FOLDS equal folds; return the fold of each sample, (k,), from 1 on.

    contact : (k,) contact node of each sample; all samples of a contact are in one fold
    Raises InputError for fewer than three contacts: one for training, one for choosing settings, and one for testing.
    """
    nodes, which = np.unique(contact, return_inverse=True)
    if len(nodes) < 3:
        raise InputError(f"tradeoff.contacts: {len(nodes)} contacts are too few to train, choose and test; give 3.")
    dealt = np.empty(len(nodes), dtype=int)
    dealt[np.random.default_rng(seed).permutation(len(nodes))] = np.arange(len(nodes)) % min(FOLDS, len(nodes)) + 1
    return dealt[which]


def fold_table(db: Database, seed: int) -> pd.DataFrame:
    """Return one row for each sample of ``db``: its contact, its peak [m] and its fold; InputError as in ``deal``."""
    columns = {"sample": np.arange(len(db.contact)), "contact": db.contact, "peak_m": db.peaks}
    return pd.DataFrame(columns | {"fold": deal(db.contact, seed)})[FOLD_COLUMNS]


def read_folds(path: Path | str) -> pd.DataFrame:
    """Read a table that ``fold_table`` made; InputError if it is missing or is no such table."""
    return read_table(path, FOLD_COLUMNS)


def fold_sides(samples: pd.DataFrame, split: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sample numbers for training, for choosing settings (validation), and for testing in a ``split``.

    split : from 1 on; s tests on fold s, chooses on the next fold (after the last the first), trains on the others
    InputError for a split that the samples do not have.
    """
    folds = int(samples["fold"].max())
    if not 1 <= split <= folds:
        raise InputError(f"tradeoff.splits: there is no split {split}; the samples have the splits 1 to {folds}.")
    test, chooses = (samples["fold"] == fold for fold in (split, split % folds + 1))
    return tuple(samples.loc[side, "sample"].to_numpy() for side in (~test & ~chooses, chooses, test))


def training_presses(samples: pd.DataFrame, split: int) -> np.ndarray:
    """Return one sample number for each training contact of a ``split``, increasing, of each of its presses in turn.

    For a model without training the errors there are those at unseen contacts.
    """
    train, *_ = fold_sides(samples, split)
    rows = samples.set_index("sample").loc[train].reset_index()
    chosen = [own["sample"].iloc[i % len(own)] for i, (_, own) in enumerate(rows.groupby("contact", sort=True))]
    return np.sort(np.array(chosen, dtype=int))


def asked_samples(samples: pd.DataFrame, splits: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the sample numbers for choosing or testing in any of ``splits``, and those for testing, both increasing.

    The first need a truth, the second one on its finest level.
    """
    sides = [fold_sides(samples, split) for split in splits]
    tested = np.unique(np.concatenate([test for _, _, test in sides]))
    return np.unique(np.concatenate([tested, *(chooses for _, chooses, _ in sides)])), tested
