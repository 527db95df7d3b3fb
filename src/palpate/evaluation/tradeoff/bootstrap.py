"""Find how sure a mean error is: a bootstrap that draws whole contacts of the test samples anew."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError
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
    """Read the errors of every model on every test sample of one scene, from where the workflow keeps them.

    data : ``results/data``; settings : the scene's rows of accuracy_vs_time.csv
    """
    place = Path(data, *settings.iloc[0][["body", "regime"]])
    return errors_from(sorted((place / "tradeoff").glob("*_samples.csv")), place / "samples.csv", settings)


def errors_from(families: Iterable[str | Path], samples: str | Path, settings: pd.DataFrame) -> pd.DataFrame:
    """Join the errors of all models of ``settings``: model, setting, sample, contact, rmse_of_peak.

    families : files of sample errors, one a family of models; samples : the table of samples of that body and regime
    Raises InputError naming a file that is missing or lacks a column, or a model that no file has.
    """
    models = [model for model in settings["model"].unique() if model != TRUTH]
    tables = [_read(path, _NEEDED) for path in families]
    found = pd.concat(tables or [pd.DataFrame(columns=_NEEDED)], ignore_index=True)
    if missing := sorted(set(models) - set(found["model"])):
        scene = settings["scene"].iloc[0]
        raise InputError(f"{scene}: the sample errors of {missing[0]} are missing: make them with the workflow (make)")
    found = found[found["model"].isin(models)]
    return found.merge(_read(samples, ["sample", "contact"]), on="sample", how="left")


def resampled(errors: pd.DataFrame) -> pd.DataFrame:
    """Return the mean rmse_of_peak of each setting in each of DRAWS draws of the contacts: rows (model, setting).

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


def _read(path: str | Path, needed: list[str]) -> pd.DataFrame:
    return read_table(path, needed)[needed]
