"""Prepare the rows of one scene for a diagram: the mean of the splits, the truth's own error, families of models."""

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import BOUNDS, EXACT, KINDS, alone, lasting, own_errors
from palpate.models.model_registry import FAMILY_OF

KNOWN = 0.003
"""Own error [of the peak] above which a truth is said not to be known well."""
JUMP = 2.0
"""A step that moves the body so many times as far as the one before is a jump."""


def own_error(settings: pd.DataFrame, column: str = "rmse_of_peak") -> float:
    """Return the own error of a scene's truth, as a share of the peak; NaN where it is not known.

    That is the larger of those on test and on validation samples, below which advice has models tied.
    """
    return float(np.fmax(*own_errors(settings, column)))


def answers(settings: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of models that answer something: neither the truth's nor the zero answer's."""
    return settings[~settings["model"].isin(BOUNDS)]


def first_split(advice: pd.DataFrame) -> pd.DataFrame:
    """Select the advice of the first split, which stands for all; of scenes that move there is no other."""
    return advice[advice["split"] == advice.groupby("scene")["split"].transform("min")]


def averaged(settings: pd.DataFrame) -> pd.DataFrame:
    """Average one scene's rows over the splits; ``<error>_low`` and ``<error>_high`` are the least and the largest.

    A setting is the same in two splits if it has the same place among those of its model, as a share of the training
    samples is not the same number everywhere; where splits have not tried as many, if it has the same name.
    Times are medians of the splits, failures and samples their sums.
    """
    place = settings.groupby(["split", "model"]).cumcount()
    tried = settings.groupby(["model", "split"])["setting"].size().groupby("model").nunique()
    by_name = settings["model"].map(tried) > 1
    key = settings["setting"].where(by_name, place.astype(str))
    groups = settings.assign(key=key).groupby(["model", "key"], sort=False)
    found = groups.first()
    means = [name for name in settings.columns if name.endswith(("_of_peak", "_m", "_l2")) or name in ("offline_s",)]
    found[means] = groups[means].mean()
    for name in ("online_median_s", "online_p95_s", "memory_mb", "break_even_queries"):
        found[name] = groups[name].median()
    for name in ("failures", "samples"):
        found[name] = groups[name].sum()
    for name in KINDS.values():
        found[f"{name}_low"], found[f"{name}_high"] = groups[name].min(), groups[name].max()
    found["splits"] = groups["split"].nunique()
    added = [*(f"{name}_{end}" for name in KINDS.values() for end in ("low", "high")), "splits"]
    return found.reset_index()[[*settings.columns, *added]]


def curves(settings: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Divide the rows of one scene into those of each curve: of each model, and of the variants of one together."""
    names = settings["model"].map(lambda model: FAMILY_OF.get(model, model))
    return dict(iter(settings.groupby(names, sort=False)))


def front_rows(settings: pd.DataFrame, column: str = "rmse_of_peak") -> pd.DataFrame:
    """Select the settings of one scene that stay on the front in other runs, fastest first, one of equal ones.

    column : the error that counts, on test samples; below the truth's own, errors are tied
    """
    own = own_error(settings, column)
    floor = max(own, EXACT) if own > 0 else EXACT
    whole = answers(settings)
    whole = whole[whole["failures"] == 0].assign(rmse_of_peak=whole[column])
    kept = whole[lasting(whole["online_median_s"], whole["rmse_of_peak"], floor)]
    rows = [alone(same, floor) for _, same in kept.groupby("model", sort=False)]
    found = pd.concat(rows).sort_values("online_median_s") if rows else kept
    return settings.loc[found.index]


def jumps(table: pd.DataFrame) -> pd.DataFrame:
    """Return the steps of ``table``, of ``limit_points``, in which a body jumps or its equilibrium is lost.

    Columns: body, contact, pressure_of_young before and after, peak_of_size before and after, least_det after.
    """
    rows = []
    for (body, contact), curve in table.groupby(["body", "contact"], sort=False):
        pressure, peak = curve["pressure_of_young"].to_numpy(), curve["peak_of_size"].to_numpy()
        slopes = np.diff(peak, prepend=0.0) / np.diff(pressure, prepend=0.0)
        for i in range(1, len(curve)):
            if not curve["converged"].iloc[i] or slopes[i] > JUMP * slopes[i - 1]:
                least = curve["least_det"].iloc[i]
                rows.append([body, contact, pressure[i - 1], pressure[i], peak[i - 1], peak[i], least])
    ends = [f"{name}_{end}" for name in ("pressure_of_young", "peak_of_size") for end in ("before", "after")]
    return pd.DataFrame(rows, columns=["body", "contact", *ends, "least_det"])
