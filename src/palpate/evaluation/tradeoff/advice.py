"""Advise which model to take for a budget of time, or for an error that must not be passed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.errors import InputError
from palpate.evaluation.tradeoff import advice_reasons as reasons
from palpate.evaluation.tradeoff.advice_choice import choice, passed_over, versus
from palpate.evaluation.tradeoff.advice_reasons import MARGIN
from palpate.evaluation.tradeoff.bootstrap import RANGE, TRUTH, resampled
from palpate.evaluation.tradeoff.equal_settings import BY_ERROR, BY_TIME, EQUAL, EXACT

NONE = "none"
"""The word that stands for a model where none fits."""


class Advice(NamedTuple):
    """One row of advice.csv: either a budget or a largest error is given; of model "none" nothing is known.

    error_low, error_high : between which the mean error lies in 5 to 95 % of draws of the contacts
    margin : share of the budget that online_p95_s leaves, or of max_error that error_high leaves
    confidence : share of the draws in which it is (tied with) the least wrong that fits, or stays under max_error
    rival, rival_setting, factor : the choice without this model, and how many times as wrong, or as slow, it is
    reference_error : of the reference itself: where a body is pressed of its mesh; where it moves of its step, which is
        added to what is compared with max_error
    faster, faster_setting, faster_error, faster_high, faster_factor : what is this many times as fast and was passed
        over, as its error may be above max_error: the error, and up to where it may be
    """

    scene: str
    budget_ms: float
    max_error: float
    model: str = NONE
    setting: str = ""
    rmse_of_peak: float = np.nan
    error_low: float = np.nan
    error_high: float = np.nan
    p95_of_peak: float = np.nan
    online_p95_s: float = np.nan
    margin: float = np.nan
    confidence: float = np.nan
    rival: str = ""
    rival_setting: str = ""
    factor: float = np.nan
    reference_error: float = np.nan
    faster: str = ""
    faster_setting: str = ""
    faster_error: float = np.nan
    faster_high: float = np.nan
    faster_factor: float = np.nan
    why: str = ""


def advise(
    settings: pd.DataFrame, errors: pd.DataFrame, budgets_ms: Sequence[float] = (), max_errors: Sequence[float] = ()
) -> pd.DataFrame:
    """Tabulate advice.csv of one scene, an ``Advice`` for each budget [ms] and each largest mean error [of the peak].

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``bootstrap.read_errors`` gives them
    A setting that failed on any sample is never advised. Of what fits a budget the least wrong is taken, of what
    stays under an error in 95 % of draws the fastest. Ties go to the faster, or the less wrong, then to less memory.
    Raises InputError if the two tables do not belong together.
    """
    settings = settings.set_index(["model", "setting"], drop=False)
    able = settings[(settings["failures"] == 0) & (settings["model"] != TRUTH)]
    _check(settings["scene"].iloc[0], able, errors)
    means = resampled(errors).reindex(able.index)
    rows = [_within(able, settings, means, budget) for budget in budgets_ms]
    rows += [_under(able, settings, means, limit) for limit in max_errors]
    return pd.DataFrame(rows, columns=Advice._fields)


def _within(able: pd.DataFrame, settings: pd.DataFrame, means: pd.DataFrame, budget_ms: float) -> Advice:
    """Choose the most accurate of what answers in time."""
    scene, own = settings["scene"].iloc[0], reasons.mesh_error(settings)
    fits = able[1e3 * able["online_p95_s"] <= (1 - MARGIN) * budget_ms]
    if fits.empty:
        return Advice(scene, budget_ms, np.nan, reference_error=own, why=reasons.late(able, settings, budget_ms))
    best, rival = choice(fits, BY_ERROR)
    least = means.loc[fits.index].min().clip(lower=EXACT)
    confidence = float((means.loc[best.name] <= EQUAL * least).mean())
    return Advice(
        scene,
        budget_ms,
        np.nan,
        **_told(best, means),
        **versus(best, rival, "rmse_of_peak"),
        reference_error=own,
        margin=1 - 1e3 * best["online_p95_s"] / budget_ms,
        confidence=confidence,
        why=reasons.within(best, rival, confidence, fits, settings, budget_ms),
    )


def _under(able: pd.DataFrame, settings: pd.DataFrame, means: pd.DataFrame, max_error: float) -> Advice:
    """Choose the fastest of what is surely accurate enough."""
    scene, highest = settings["scene"].iloc[0], means.quantile(RANGE[1], axis=1)
    own = reasons.mesh_error(settings)
    fits = able[(highest <= max_error).to_numpy()]
    if fits.empty:
        return Advice(
            scene, np.nan, max_error, reference_error=own, why=reasons.wrong(able, highest, settings, max_error)
        )
    best, rival = choice(fits, BY_TIME)
    passed = passed_over(able, highest, best, "online_median_s", max_error)
    return Advice(
        scene,
        np.nan,
        max_error,
        **_told(best, means),
        **versus(best, rival, "online_median_s"),
        reference_error=own,
        **passed,
        margin=1 - highest[best.name] / max_error,
        confidence=float((means.loc[best.name] <= max_error).mean()),
        why=reasons.under(best, rival, passed, fits, settings, max_error),
    )


def _told(best: pd.Series, means: pd.DataFrame) -> dict:
    low, high = means.loc[best.name].quantile(list(RANGE))
    copied = ("model", "setting", "rmse_of_peak", "p95_of_peak", "online_p95_s")
    return {name: best[name] for name in copied} | {"error_low": low, "error_high": high}


def _check(scene: str, able: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Raise InputError if a setting stands twice or its samples do not have the mean that its row gives."""
    if able.index.has_duplicates:
        twice = able[able.index.duplicated()].iloc[0]
        raise InputError(f"accuracy_vs_time.csv has {reasons.name(twice)} of {scene} twice: give each its own setting")
    found = errors.groupby(["model", "setting"])["rmse_of_peak"].mean().reindex(able.index)
    if not (right := np.isclose(found, able["rmse_of_peak"], rtol=1e-6, atol=0)).all():
        raise InputError(
            f"accuracy_vs_time.csv and the samples of {reasons.name(able[~right].iloc[0])} of {scene} disagree: "
            "make both anew with the workflow"
        )
