"""Compare contact-ordered with unordered features in several premises, in several splits, with intervals."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Method, sample_errors
from palpate.benchmark.comparison import RANGE, resampled
from palpate.benchmark.database import Database
from palpate.benchmark.model import FitOptions
from palpate.benchmark.split import SPLITS, split
from palpate.models import interpolation
from palpate.models.enrichment import paper_enrichment
from palpate.models.enrichment.features import FEATURES
from palpate.models.enrichment.fitting import Fitting
from palpate.models.enrichment.paper_enrichment import LITERAL

READINGS = ("nonnegative_a", "nonnegative_b", LITERAL)
"""Ways to weigh samples that are compared: the paper's text allows each."""
PAPERS = "nonnegative_a"
LINEAR = "linear"
NONE = "none"
"""The weights of answers that blend nothing."""
MOVED = 0.1
"""Share of the peak from which on a node counts as moved."""


class Zero:
    """The answer that nothing moves, whose error others must beat."""

    sigma_m = np.nan

    def __init__(self, db: Database):
        self._shape = db.nodes_fine_surface.shape

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return zeros (n, 3) [m]."""
        return np.zeros(self._shape)


def split_errors(db: Database, counts: tuple[int, int], number: int, options: FitOptions) -> Iterator[pd.DataFrame]:
    """Yield the errors of every method on the test samples of one split, for each of SPLITS.

    With samples held out, as in the paper, only its own weights are asked.
    counts : samples to train on and to hold out; number : of the split, from 0 on, which its seed grows with
    """
    for kind in SPLITS:
        asked = replace(options, split=kind, seed=options.seed + number)
        train, test = split(db.contact, *counts, kind, asked.seed)
        fitting = Fitting.of(db, train, "paper", asked)
        methods: dict[tuple[str, str], Method] = {
            ("zero", NONE): Zero(db),
            ("interpolation", NONE): interpolation.fit(fitting),
        }
        for features in FEATURES:
            readings = READINGS if kind == "contacts" else (PAPERS,)
            methods |= {(features, weights): paper_enrichment.fit(fitting, features, weights) for weights in readings}
            if kind == "contacts":
                methods[features, LINEAR] = paper_enrichment.fit_linear(fitting, features)
        yield _errors(db, methods, train, test, number, kind)


def growing_errors(
    db: Database, counts: tuple[int, int], number: int, options: FitOptions, shares: Sequence[float]
) -> Iterator[pd.DataFrame]:
    """Yield the errors of the paper's weights with smaller ``shares`` of the training contacts; contacts held out."""
    asked = replace(options, split="contacts", seed=options.seed + number)
    train, test = split(db.contact, *counts, "contacts", asked.seed)
    known = np.random.default_rng(asked.seed).permutation(np.unique(db.contact[train]))
    # fewer than two cannot be divided into folds, and all are asked already
    for count in sorted({max(2, round(share * len(known))) for share in shares} - {len(known)}):
        kept = known[:count]
        some = train[np.isin(db.contact[train], kept)]
        fitting = Fitting.of(db, some, "paper", asked)
        methods = {(features, PAPERS): paper_enrichment.fit(fitting, features, PAPERS) for features in FEATURES}
        yield _errors(db, methods, some, test, number, "contacts")


def _errors(db: Database, methods: dict, train: np.ndarray, test: np.ndarray, number: int, kind: str) -> pd.DataFrame:
    found = []
    for (features, weights), method in methods.items():
        table = sample_errors(db, method, "paper", test)[["sample", "rmse_of_peak"]]
        table["contact"] = db.contact[table["sample"]]
        found.append(table.assign(features=features, weights=weights))
    return pd.concat(found).assign(split=number, held_out=kind, train=len(train))


def summarise(errors: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the errors of one premise: their means, and how sure these and their ratios to unordered features are.

    errors : with the columns held_out, train, split, features, weights, sample, contact, rmse_of_peak
    Returns held_out, train, features, weights, splits, rmse_of_peak, error_low, error_high, and the ratio to unordered
    features with the same weights, ratio, ratio_low, ratio_high; intervals hold the middle 90 % of draws of contacts.
    """
    rows = []
    for (kind, train), table in errors.groupby(["held_out", "train"], sort=False):
        draws = resampled(table.rename(columns={"features": "model", "weights": "setting"}), "rmse_of_peak")
        means = table.groupby(["features", "weights"], sort=False)["rmse_of_peak"].mean()
        for (features, weights), mean in means.items():
            row = [kind, train, features, weights, table["split"].nunique(), mean]
            row += np.quantile(draws.loc[(features, weights)], RANGE).tolist()
            against = ("unordered", weights)
            if against in means.index:
                ratios = draws.loc[(features, weights)] / draws.loc[against]
                row += [mean / means[against], *np.quantile(ratios, RANGE)]
            else:
                row += [np.nan] * 3
            rows.append(row)
    return pd.DataFrame(rows, columns=SUMMARY)


SUMMARY = [
    "held_out", "train", "features", "weights", "splits", "rmse_of_peak", "error_low", "error_high",
    "ratio", "ratio_low", "ratio_high",
]  # fmt: skip


LOCAL = 0.125
"""Largest share of the surface that moves, by MOVED of the peak, in a deformation that counts as local, as the paper
assumes it: its features see ten coarse nodes, 5 to 7 % of its bodies', and here up to twice as many may move."""


def moved_share(fine: np.ndarray) -> float:
    """Return the mean share of nodes that move by more than MOVED of the peak of their sample; fine : (k, n, 3) [m]."""
    moved = np.linalg.norm(fine, axis=2)
    return float((moved > MOVED * moved.max(axis=1, keepdims=True)).mean())
