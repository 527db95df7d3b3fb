"""Find how sure a mean error is: a bootstrap that draws whole splits, and whole contacts of each, anew."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.equal_settings import KINDS
from palpate.errors import InputError
from palpate.files import read_table

DRAWS = 2000
RANGE = (0.05, 0.95)
"""The quantiles of the draws between which a mean error is said to lie."""
SEED = 1
"""Of the draws; the same for the table of advice and the command, so that both say the same."""

TRUTH, OWN_ERROR = "truth", "own error"
"""Model and setting in whose row the truth's own error stands."""
ZERO = "zero"
"""The model that answers that nothing moves."""
BOUNDS = (TRUTH, ZERO)
"""Models of the tables that nobody can choose."""

COLUMNS = ["model", "setting", "split", "side", "sample", "contact", *KINDS.values()]


def read_errors(data: str | Path, settings: pd.DataFrame) -> pd.DataFrame:
    """Read the errors of every model on every sample of one scene, from where the workflow keeps them.

    data : ``results/data``; settings : the scene's rows of accuracy_vs_time.csv
    """
    place = Path(data, *settings.iloc[0][["body", "regime"]])
    return errors_from(sorted((place / "tradeoff").rglob("*_samples.csv")), settings)


def errors_from(families: Iterable[str | Path], settings: pd.DataFrame) -> pd.DataFrame:
    """Join the errors of all models of ``settings``, in the splits it has: the columns COLUMNS.

    families : files of sample errors, one a family of models
    Raises InputError naming a file that is missing or lacks a column, or a model that no file has.
    """
    models = [model for model in settings["model"].unique() if model not in BOUNDS]
    tables = [read_table(path, COLUMNS)[COLUMNS] for path in families]
    found = pd.concat(tables or [pd.DataFrame(columns=COLUMNS)], ignore_index=True)
    if missing := sorted(set(models) - set(found["model"])):
        scene = settings["scene"].iloc[0]
        raise InputError(f"{scene}: the sample errors of {missing[0]} are missing: make them with the workflow (make)")
    return found[found["model"].isin(models) & found["split"].isin(settings["split"])]


def resampled(errors: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return the mean of ``column`` for each setting in each of DRAWS draws: rows (model, setting).

    errors : of one side of one scene, with the columns model, setting, split, sample, contact and ``column``
    Each draw takes as many splits as there are, with repetition, and of each as many of its contacts. All settings see
    the same draws, so they can be compared draw by draw. A setting without an answer to every sample has no row.
    Trap: forces at one contact are errors of one kind, and drawing single samples would feign certainty.
    """
    table = errors.pivot_table(column, ["model", "setting"], ["split", "contact"], aggfunc=["sum", "count"])
    sums, counts = table["sum"], table["count"]
    asked = errors.groupby(["split", "contact"])["sample"].nunique()
    whole = (counts == asked.reindex(counts.columns)).all(axis=1)
    sums, counts = sums[whole], counts[whole]
    drawn = _drawn(sums.columns.get_level_values("split").to_numpy())
    means = (sums.to_numpy() @ drawn.T) / (counts.to_numpy() @ drawn.T)
    return pd.DataFrame(means, index=sums.index)


def _drawn(split: np.ndarray) -> np.ndarray:
    """Draw how often each contact is taken, (DRAWS, n); split : (n,) the split that each contact is tested in."""
    random = np.random.default_rng(SEED)
    names = np.unique(split)
    taken = random.multinomial(len(names), np.full(len(names), 1 / len(names)), size=DRAWS)
    drawn = np.zeros((DRAWS, len(split)))
    for times, name in zip(taken.T, names, strict=True):
        own = np.flatnonzero(split == name)
        drawn[:, own] = random.multinomial(times * len(own), np.full(len(own), 1 / len(own)))
    return drawn
