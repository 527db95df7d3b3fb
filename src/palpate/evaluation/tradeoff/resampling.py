"""How sure a mean error is: the test samples drawn anew, whole contacts at a time."""

from pathlib import Path

import numpy as np
import pandas as pd

from palpate.files import read_table

DRAWS = 2000
RANGE = (0.05, 0.95)
"""The quantiles of the draws between which a mean error is said to lie."""
SEED = 1
"""Of the draws; the same for the table of advice and the command, so that both say the same."""

TRUTH, EXTRAPOLATED = "reference", "extrapolated"
"""Model and setting in whose row the fine mesh's own error stands, the contact's surroundings aside; none to choose."""

_NEEDED = ["model", "setting", "sample", "rmse_of_peak"]


def read_errors(data: str | Path, settings: pd.DataFrame) -> pd.DataFrame:
    """Errors of every model on every test sample of one scene: model, setting, sample, contact, rmse_of_peak.

    data : ``results/data``; settings : the scene's rows of accuracy_vs_time.csv
    Raises InputError naming a file that is missing or lacks a column.
    """
    place = Path(data, *settings.iloc[0][["body", "regime"]])
    models = [model for model in settings["model"].unique() if model != TRUTH]
    found = pd.concat([_read(place / "tradeoff" / f"{model}.csv", _NEEDED) for model in models], ignore_index=True)
    return found.merge(_read(place / "split.csv", ["sample", "contact"]), on="sample", how="left")


def resampled(errors: pd.DataFrame) -> pd.DataFrame:
    """Mean rmse_of_peak of each setting in each of DRAWS draws of the contacts: rows (model, setting).

    errors : of one scene, as ``read_errors`` gives them
    All settings see the same draws, so they can be compared draw by draw. A setting without an answer to
    every sample has no row.
    Trap: forces at one contact are errors of one kind, and drawing single samples would feign certainty.
    """
    table = errors.pivot_table("rmse_of_peak", ["model", "setting"], "contact", aggfunc=["sum", "count"])
    sums, counts = table["sum"], table["count"]
    whole = (counts == errors.groupby("contact")["sample"].nunique()).all(axis=1)
    sums, counts = sums[whole], counts[whole]
    n = sums.shape[1]
    drawn = np.random.default_rng(SEED).multinomial(n, np.full(n, 1 / n), size=DRAWS)
    means = (sums.to_numpy() @ drawn.T) / (counts.to_numpy() @ drawn.T)
    return pd.DataFrame(means, index=sums.index)


def _read(path: Path, needed: list[str]) -> pd.DataFrame:
    return read_table(path, needed)[needed]
