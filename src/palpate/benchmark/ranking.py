"""Compare settings: how sure a mean error is, which count as equal in another run, and which no other beats."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError
from palpate.files import read_table

TIED_TIMES = 1.5
"""Times within this factor are tied: medians that repeat within 20 % each can change their ratio by 1.2²."""
EQUAL = 1.05
"""Errors within this factor are tied: they repeat bit for bit, but such a difference decides nothing."""
EXACT = 1e-5
"""Errors below this share of the peak are tied with it: nobody could measure them."""
ALIKE = 1.1
"""Memory within this factor is tied."""

KINDS = {"rms": "rmse_of_peak", "patch": "patch_rms_of_peak"}
"""The kinds of error that advice goes by, and their columns: over the whole surface, or where it is pressed."""
ERRORS = (*KINDS.values(), "limit", "mean")
"""The columns of errors that settings are ordered by: of tables, and of ``choosing.Candidates``."""

BY_ERROR = (("rmse_of_peak", EQUAL), ("online_median_s", TIED_TIMES), ("memory_mb", ALIKE))
"""What decides, in turn, between settings of which the least error is wanted: as ``pick`` takes it."""


def pick(rows: pd.DataFrame, order: Iterable[tuple[str, float]], floor: float = EXACT) -> pd.Series:
    """Return the row that is left when each column in turn keeps what is within a factor of its least value.

    Errors below ``floor`` are tied with it, and an empty cell is the largest. Where several rows are left, the first.
    """
    remaining = np.arange(len(rows))
    for name, factor in order:
        values = rows[name].to_numpy(float)[remaining]
        values = np.where(np.isnan(values), np.inf, np.maximum(values, floor) if name in ERRORS else values)
        remaining = remaining[values <= factor * values.min()]
    return rows.iloc[remaining[0]]


def lasting(seconds: np.ndarray, error: np.ndarray, floor: float = EXACT) -> np.ndarray:
    """Mark which of n points, with a time and an error each, are on the Pareto front in another run too: (n,) bool.

    A point is not if another is clearly less wrong and not clearly slower, or clearly faster and not clearly more
    wrong: beyond the factors EQUAL and TIED_TIMES. One that is not finite is never on it. Errors below ``floor`` are
    tied with it.
    Trap: a point may be left out for one that is left out for a third; the exact front is ``front``.
    """
    seconds, error = np.asarray(seconds, float), np.asarray(error, float)
    times, errors = np.where(np.isfinite(seconds + error), [seconds, np.maximum(error, floor)], np.inf)
    less_wrong = (times[None] <= TIED_TIMES * times[:, None]) & (EQUAL * errors[None] < errors[:, None])
    faster = (TIED_TIMES * times[None] < times[:, None]) & (errors[None] <= EQUAL * errors[:, None])
    return np.isfinite(times) & ~(less_wrong | faster).any(axis=1)


def alone(rows: pd.DataFrame, floor: float = EXACT) -> pd.DataFrame:
    """Drop the rows that are tied in error and in time with a row kept before; errors below ``floor`` are tied."""
    error, seconds = rows["rmse_of_peak"].clip(lower=floor).to_numpy(), rows["online_median_s"].to_numpy()
    kept: list[int] = []
    for i in range(len(rows)):
        error_apart = [max(error[i], error[j]) > EQUAL * min(error[i], error[j]) for j in kept]
        time_apart = [max(seconds[i], seconds[j]) > TIED_TIMES * min(seconds[i], seconds[j]) for j in kept]
        if all(by_error or by_time for by_error, by_time in zip(error_apart, time_apart, strict=True)):
            kept.append(i)
    return rows.iloc[kept]


DRAWS = 2000
RANGE = (0.05, 0.95)
"""The quantiles of the draws between which a mean error is said to lie."""
SEED = 1
"""Seed of the draws: one, so that advice.csv and ``palpate advise`` say the same."""

TRUTH, OWN_ERROR = "truth", "own error"
"""Model and setting in whose row the truth's own error stands."""
ZERO = "zero"
"""The model whose answer is no displacement at all."""
BOUNDS = (TRUTH, ZERO)
"""Rows of the tables that are no models to choose from."""
SIDES = ("validation", "test")
"""The names of the sides: settings are chosen on the first, and their errors reported on the second."""
TRAINING = "training"
"""The name of the side of the samples that models may learn from; those that do not are asked for some of them."""


UNKNOWN = "the truth is not known here: what stands for an error is the distance from the finest elements"
"""What is said of a scene in which no truth is believed."""


def unknown(errors: pd.DataFrame, column: str) -> str:
    """Say of how many presses of a scene the truth is not known, if that is so of any; ``errors`` as ``own_errors``."""
    own = errors[errors["model"] == TRUTH].dropna(subset=column)
    every, known = errors["sample"].nunique(), own["sample"].nunique()
    if not known:
        return UNKNOWN
    lost = f"{every - known} of {every} presses have no truth, and their errors are distances from the finest elements"
    return lost if known < every else ""


def own_error(settings: pd.DataFrame, column: str = "rmse_of_peak") -> float:
    """Return the own error of a scene's truth, as a share of the peak; NaN where it is not known.

    The larger of the means over test and over validation samples: one number a scene, the same wherever it is named.
    """
    truth = settings[settings["model"] == TRUTH]
    return float(np.fmax(truth[column].mean(), truth[f"validation_{column}"].mean()))


def own_errors(errors: pd.DataFrame, column: str, samples: np.ndarray) -> np.ndarray:
    """Return the truth's own error of each of ``samples`` (n,), as shares of the peak, to be added to models' errors.

    errors : of one scene, with the columns model, sample and ``column``
    Where it is not known, the largest that is known stands for it; NaN where none is.
    """
    by_sample = errors[errors["model"] == TRUTH].groupby("sample")[column].max()
    return by_sample.reindex(samples).fillna(by_sample.max()).to_numpy()


def same_settings(settings: pd.DataFrame) -> pd.Series:
    """Return a key of each row's setting among those of its model, the same for one setting in several splits.

    settings : of one scene
    The key is the place among the settings of the model in a split, as a name may have a number of samples in it that
    differs between splits; where splits have not tried as many settings, it is the name.
    """
    position = settings.groupby(["split", "model"]).cumcount()
    counts = settings.groupby(["model", "split"])["setting"].size().groupby("model").nunique()
    return settings["setting"].where(settings["model"].map(counts) > 1, position.astype(str))


def averaged(settings: pd.DataFrame) -> pd.DataFrame:
    """Average the rows of one scene over the splits: a row for each setting, as ``same_settings`` tells them apart.

    A setting has its name in the first split. Errors are means, and ``<error>_low`` and ``<error>_high`` the least and
    the largest; times are medians, but ``online_max_s`` is the largest; samples and failures are summed.
    """
    groups = settings.assign(key=same_settings(settings)).groupby(["model", "key"], sort=False)
    rows = groups.first()
    mean_columns = [name for name in settings.columns if name.endswith(("_of_peak", "_m", "_l2", "offline_s"))]
    rows[mean_columns] = groups[mean_columns].mean()
    for name in ("online_median_s", "online_p95_s", "memory_mb", "break_even_queries"):
        rows[name] = groups[name].median()
    rows["online_max_s"] = groups["online_max_s"].max()
    for name in ("failures", "samples", "rejected", "rejected_answered"):
        rows[name] = groups[name].sum()
    for name in KINDS.values():
        rows[f"{name}_low"], rows[f"{name}_high"] = groups[name].min(), groups[name].max()
    rows["splits"] = groups["split"].nunique()
    further_columns = [*(f"{name}_{end}" for name in KINDS.values() for end in ("low", "high")), "splits"]
    return rows.reset_index()[[*settings.columns, *further_columns]]


def fields_of(rows: pd.DataFrame, *names: str) -> pd.DataFrame:
    """Return these fields of the settings' texts, such as "level=1, start=rest": a column each, NaN where it has none.

    The inverse of ``setting_text``, and the one place that reads such a text.
    """
    parts = [dict(part.split("=", 1) for part in text.split(", ") if "=" in part) for text in rows["setting"]]
    values = [{name: _value(part[name]) for name in names if name in part} for part in parts]
    return pd.DataFrame(values, index=rows.index, columns=list(names))


def _value(text: str) -> int | float | bool | str:
    try:
        return json.loads(text)
    except ValueError:
        return text


COLUMNS = ["model", "setting", "split", "side", "sample", "contact", *KINDS.values()]


def read_errors(data: str | Path, settings: pd.DataFrame) -> pd.DataFrame:
    """Read the errors of every model on every sample of one scene from the files of the workflow.

    data : ``results/data``; settings : the scene's rows of accuracy_vs_time.csv
    """
    place = Path(data, *settings.iloc[0][["body", "regime"]])
    return errors_from(sorted((place / "tradeoff").rglob("*_samples.csv")), settings)


def errors_from(families: Iterable[str | Path], settings: pd.DataFrame) -> pd.DataFrame:
    """Join the errors of the models and of the truth itself, in the splits of ``settings``: the columns COLUMNS.

    families : files of sample errors, one a family of models
    Raises InputError naming a file that is missing or lacks a column, or a model that no file has.
    """
    models = [model for model in settings["model"].unique() if model not in BOUNDS]
    tables = [read_table(path, COLUMNS)[COLUMNS] for path in families]
    errors = pd.concat(tables or [pd.DataFrame(columns=COLUMNS)], ignore_index=True)
    if missing := sorted(set(models) - set(errors["model"])):
        scene = settings["scene"].iloc[0]
        raise InputError(f"{scene}: the sample errors of {missing[0]} are missing: make them with the workflow (make)")
    return errors[errors["model"].isin([*models, TRUTH]) & errors["split"].isin(settings["split"])]


def resampled(errors: pd.DataFrame, column: str) -> pd.DataFrame:
    """Resample whole contacts (bootstrap); return the mean error of each setting in each draw: (settings, DRAWS).

    errors : of one side of one scene, with the columns model, setting, split, sample, contact and ``column``
    Each draw takes as many splits as there are, with repetition, and of each as many of its contacts. All settings see
    the same draws, so they can be compared draw by draw. A setting without an answer to every sample has no row.
    Trap: answers to several forces at one contact err alike, so drawing single samples would feign certainty.
    """
    table = errors.pivot_table(column, ["model", "setting"], ["split", "contact"], aggfunc=["sum", "count"])
    sums, counts = table["sum"], table["count"]
    samples = errors.groupby(["split", "contact"])["sample"].nunique()
    is_complete = (counts == samples.reindex(counts.columns)).all(axis=1)
    sums, counts = sums[is_complete], counts[is_complete]
    times_drawn = _drawn(sums.columns.get_level_values("split").to_numpy())
    means = (sums.to_numpy() @ times_drawn.T) / (counts.to_numpy() @ times_drawn.T)
    return pd.DataFrame(means, index=sums.index)


def _drawn(split: np.ndarray) -> np.ndarray:
    """Draw how often each of n contacts is taken: (DRAWS, n); split : (n,) in which each is tested."""
    random = np.random.default_rng(SEED)
    splits = np.unique(split)
    counts = random.multinomial(len(splits), np.full(len(splits), 1 / len(splits)), size=DRAWS)
    times_drawn = np.zeros((DRAWS, len(split)))
    for times, name in zip(counts.T, splits, strict=True):
        contacts = np.flatnonzero(split == name)
        times_drawn[:, contacts] = random.multinomial(times * len(contacts), np.full(len(contacts), 1 / len(contacts)))
    return times_drawn


def front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Find the indices of the non-dominated points, in order of rising cost.

    cost, error : (n,), both to be small; a point that is not finite is never on the front.
    A point is dominated if another is at least as good in both and better in one; equal points are all kept.
    """
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    kept, least_error, its_cost = [], np.inf, np.inf
    for i in np.lexsort((error, cost)):
        if not (np.isfinite(cost[i]) and np.isfinite(error[i])):
            continue
        if error[i] < least_error or (error[i] == least_error and cost[i] == its_cost):
            kept.append(i)
            least_error, its_cost = error[i], cost[i]
    return np.array(kept, dtype=int)
