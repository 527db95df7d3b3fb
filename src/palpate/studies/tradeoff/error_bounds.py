"""Tabulate error_bounds.csv: bounds of a single answer's error, by what they are estimated from, and how they hold."""

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import CONSTANT, OWN, bound_factor, bound_row
from palpate.benchmark.press_measure import COARSER as APART
from palpate.benchmark.press_measure import ESTIMATED
from palpate.benchmark.ranking import BOUNDS, EXACT, KINDS, TRAINING, lasting, own_errors
from palpate.table_declaration import Table

ERROR_BOUNDS = Table(
    "error_bounds",
    "Below what the error of a single answer stays in nine cases of ten, by what that is estimated from.",
    """
    scene body regime model setting error: what answers, and the kind of error
    estimate: what its error is estimated from
    contacts samples rank_correlation: what it was tried on, and how well estimates order errors
    error_of_peak own_of_peak: medians of the error, and of the truth's own, which is added to it in all that follows
        and empty where no truth is known
    bound_factor bound_of_peak sharpness: factor of an estimate, median bound, bound / error
    coverage coverage_low coverage_of_contacts coverage_elsewhere: answers below their bound; the low end of
        that; contacts wholly below; and below bounds of other bodies
    estimate_s: time of an estimate [s]
    """,
)
RESIDUAL, COARSER = "residual", "coarser"
"""Estimates from one fine residual, and from a second, coarser answer."""
EVERY = "every model"
"""The model in whose row an estimate stands that does not look at the answer."""
SAMPLES = [
    "model", "setting", "split", "side", "sample", "contact", *KINDS.values(), ESTIMATED, *APART.values(),
]  # fmt: skip
"""The columns that are read of the samples' errors."""
_SETTING, _ASKED = ["model", "setting"], ["split", "sample", "contact"]


class Scene(NamedTuple):
    """All that is known of one scene.

    settings : its rows of accuracy_vs_time.csv; errors : of all models on all samples they were asked, with SAMPLES
    estimates : the table of ``error_estimates.estimates``, of all its splits
    """

    settings: pd.DataFrame
    errors: pd.DataFrame
    estimates: pd.DataFrame


class _SceneErrors:
    """The errors of one kind in one scene, and their estimates, of settings that answered all they were asked.

    At training contacts, where settings that learn nothing are asked too, they need not have answered.
    errors : by setting, a series (n,) over _ASKED, the truth's own error added (``advice.presses`` says why), if known
    estimates : by setting and the name of an estimate, its values (n,), and the time of finding one [s]
    own : returns the truth's own error (k,) of samples (k,); NaN where it is not known
    """

    def __init__(self, scene: Scene, kind: str):
        self.body, self.regime = scene.settings[["body", "regime"]].iloc[0]
        self.own = partial(own_errors, scene.errors, KINDS[kind])
        errors = scene.errors[~scene.errors["model"].isin(BOUNDS)]
        own = np.nan_to_num(self.own(errors["sample"].to_numpy()))
        errors = errors.assign(**{KINDS[kind]: errors[KINDS[kind]] + own})
        answering = errors[errors["side"] != TRAINING].pivot_table(KINDS[kind], _SETTING, _ASKED).dropna().index
        of_settings = errors.dropna(subset=KINDS[kind]).set_index(_ASKED).groupby(_SETTING, sort=True)[KINDS[kind]]
        self.errors: dict[tuple[str, str], pd.Series] = {key: values for key, values in of_settings if key in answering}
        self.estimates = {key: {CONSTANT: (np.ones(len(values)), 0.0)} for key, values in self.errors.items()}
        estimates = _estimates(scene.estimates, errors, kind)
        for (model, setting, name), values in estimates.groupby([*_SETTING, "estimate"], sort=False):
            value, seconds = values.set_index(_ASKED)["value"], float(values["seconds"].median())
            for key in self.errors if model == EVERY else self.errors.keys() & {(model, setting)}:
                estimated = np.maximum(value.reindex(self.errors[key].index).to_numpy(), EXACT)
                if np.isfinite(estimated).all():
                    self.estimates[key][str(name)] = estimated, seconds

    def contact(self, key: tuple[str, str]) -> np.ndarray:
        """Return the contact (n,) of each error of a setting."""
        return self.errors[key].index.get_level_values("contact").to_numpy()


def _estimates(measured: pd.DataFrame, errors: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Return all estimates of the errors of one kind: _SETTING, _ASKED, the estimate's name, its value, and seconds.

    measured : of ``error_estimates.estimates``; errors : of samples, with what the models say and what is apart
    Those that do not look at the answer come first.
    """
    is_coarser = measured["estimate"] == COARSER
    seconds, estimated = (
        measured.loc[is_coarser, "seconds"].median(),
        measured[~is_coarser].assign(value=measured.loc[~is_coarser, kind]),
    )
    is_general = estimated["model"] == EVERY
    by_model = errors.dropna(subset=ESTIMATED).assign(estimate=OWN, seconds=0.0, value=lambda rows: rows[ESTIMATED])
    by_coarser = errors.dropna(subset=APART[kind])
    by_coarser = by_coarser.assign(estimate=COARSER, seconds=seconds, value=by_coarser[APART[kind]])
    columns = [*_SETTING, *_ASKED, "estimate", "value", "seconds"]
    return pd.concat([part[columns] for part in (estimated[is_general], estimated[~is_general], by_model, by_coarser)])


def error_bounds(scenes: Iterable[Scene]) -> pd.DataFrame:
    """Tabulate a row for each kind of error, estimate, and setting that lasts on a front or is its model's best.

    A bound is a factor times the estimate, found by conformal prediction with contacts as the unit: empty where these
    are too few. Other bodies are those in the same regime.
    """
    all_scenes = list(scenes)
    rows: list[dict] = []
    for kind in KINDS:
        scored = [_SceneErrors(scene, kind) for scene in all_scenes]
        for scene, scene_errors in zip(all_scenes, scored, strict=True):
            others = [each for each in scored if each.regime == scene_errors.regime and each.body != scene_errors.body]
            labels = scene.settings[["scene", "body", "regime"]].iloc[0].to_dict()
            for key in _chosen(scene.settings, scene_errors, kind):
                for name, (values, seconds) in scene_errors.estimates[key].items():
                    row = labels | dict(zip(_SETTING, key, strict=True)) | {"error": kind, "estimate": name}
                    row |= _row(scene_errors, key, values) | {"estimate_s": seconds}
                    rows.append(row | {"coverage_elsewhere": _elsewhere(scene_errors, others, key, name)})
    return ERROR_BOUNDS.frame(rows)


def _row(scored: _SceneErrors, key: tuple[str, str], estimate: np.ndarray) -> dict:
    """Return how well an estimate (n,) of the errors of a setting orders them, and the bound that it gives."""
    errors, contact = scored.errors[key].to_numpy(), scored.contact(key)
    truth_own = scored.own(scored.errors[key].index.get_level_values("sample").to_numpy())
    row = {"contacts": len(np.unique(contact)), "samples": len(errors), "own_of_peak": np.median(truth_own)}
    row |= {"error_of_peak": np.median(errors - np.nan_to_num(truth_own))} | bound_row(errors, estimate, contact)
    return row | {"bound_of_peak": np.median(row["bound_factor"] * estimate)}


def _elsewhere(here: _SceneErrors, others: list[_SceneErrors], key: tuple[str, str], estimate: str) -> float:
    """Return the share of the errors of a setting below the bound that is found on other bodies; NaN without one."""
    known = [each for each in others if key in each.errors and estimate in each.estimates[key]]
    if not known:
        return np.nan
    scores = np.concatenate([each.errors[key].to_numpy() / each.estimates[key][estimate][0] for each in known])
    shift = 1 + max(each.contact(key).max() for each in known)  # so that contacts of two bodies have two numbers
    factor = bound_factor(scores, np.concatenate([each.contact(key) + i * shift for i, each in enumerate(known)]))
    is_below = here.errors[key].to_numpy() <= factor * here.estimates[key][estimate][0]
    return float(np.mean(is_below)) if np.isfinite(factor) else np.nan


def _chosen(settings: pd.DataFrame, scored: _SceneErrors, kind: str) -> list[tuple[str, str]]:
    """List the settings that are tabulated: on the lasting front, the best of a model, or with a special estimate.

    The front and the best are by validation errors; special is an estimate from the residual, or by the model itself.
    """
    rows = settings[settings["split"] == settings["split"].min()].set_index(_SETTING, drop=False)
    rows = rows[rows.index.isin(list(scored.errors)) & (rows["failures"] == 0)]
    error = rows[f"validation_{KINDS[kind]}"]
    front = lasting(rows["online_median_s"].to_numpy(), error.to_numpy())
    best = error == error.groupby(rows["model"].to_numpy()).transform("min")
    special = np.array([not {RESIDUAL, OWN}.isdisjoint(scored.estimates[key]) for key in rows.index], dtype=bool)
    return list(rows.index[front | best.to_numpy() | special])
