"""Advise which model to take for a budget of time, or for an error that must not be passed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import BOUNDS, EQUAL, KINDS, RANGE, by_error, by_time, resampled
from palpate.benchmark.conformal import bound_factor, finite
from palpate.errors import InputError
from palpate.studies.tradeoff import advice_reasons as reasons
from palpate.studies.tradeoff.advice_choice import choice, passed_over, versus
from palpate.studies.tradeoff.advice_reasons import MARGIN, Known

NONE = "none"
"""The word that stands for a model where none fits."""


class Advice(NamedTuple):
    """One row of advice.csv: either a budget or a largest error is given; of model "none" nothing is known.

    error : the kind that is asked about, of KINDS: "rms" over the whole surface, or at the "patch" that is pressed
    split : the number of the split; 0 for a scene that moves, where nothing is divided
    rmse_of_peak, patch_rms_of_peak, p95_of_peak : means over the test samples, which had no part in the choice
    validation_error : the mean that it was chosen by
    error_low, error_high : between which the mean error of this kind lies in 5 to 95 % of draws of splits and contacts
    bound_of_peak : below which the error of a single answer at another contact stays in nine cases of ten, as found on
        validation and test contacts by ``conformal.bound_factor``; NaN where these are too few
    margin : share of the budget that online_p95_s leaves, or of max_error that error_high leaves; negative if too large
    confidence : share of the draws in which it is (tied with) the least wrong that fits, or stays under max_error
    rival, rival_setting, factor : the choice without this model, and how many times as wrong, or as slow, it is
    reference_error : of this kind, of the truth itself, below which models are tied, the larger of that on validation
        and on test samples; where a body moves that of the reference's step, which is added to what is compared with
        max_error
    faster, faster_setting, faster_error, faster_high, faster_factor : what is this many times as fast and was passed
        over, as its error may be above max_error: the error that it was judged by, and up to where it may be
    speed, times_life : of a scene that moves, seconds of motion in a second: asked for, and reached
    bound_on : of a scene that moves, what bound_of_peak was measured on; or why there is none
    """

    scene: str
    error: str
    split: int
    budget_ms: float
    max_error: float
    model: str = NONE
    setting: str = ""
    rmse_of_peak: float = np.nan
    patch_rms_of_peak: float = np.nan
    validation_error: float = np.nan
    error_low: float = np.nan
    error_high: float = np.nan
    bound_of_peak: float = np.nan
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
    speed: float = np.nan
    times_life: float = np.nan
    bound_on: str = ""
    why: str = ""


def advise(
    settings: pd.DataFrame,
    errors: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    kinds: Sequence[str] = tuple(KINDS),
) -> pd.DataFrame:
    """Tabulate advice.csv of one scene: an ``Advice`` for each kind, split, budget [ms] and largest mean error.

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``bootstrap.read_errors`` gives them
    Settings are chosen by their errors on the validation samples of the split; what is said of them is measured on its
    test samples. A setting that failed on any sample is never advised. Of what fits a budget the least wrong is taken,
    of what stays under an error in 95 % of draws the fastest. Below the truth's own error models are tied, and no
    smaller error is promised. Ties go to the faster, or the less wrong, then to less memory.
    Raises InputError if the two tables do not belong together.
    """
    found: list[Advice] = []
    for kind in kinds:
        for _, rows in settings.groupby("split", sort=True):
            asked = _Question(rows.set_index(["model", "setting"], drop=False), errors, kind)
            found += [asked.within(budget) for budget in budgets_ms]
            found += [asked.under(limit) for limit in max_errors]
    return pd.DataFrame(found, columns=Advice._fields)


class _Question:
    """Everything that the answers about one kind of error in one split have in common."""

    def __init__(self, settings: pd.DataFrame, errors: pd.DataFrame, kind: str):
        self.scene, self.kind, self.split = settings["scene"].iloc[0], kind, int(settings["split"].iloc[0])
        column = KINDS[kind]
        self.known = Known(settings, column)
        able = settings[(settings["failures"] == 0) & ~settings["model"].isin(BOUNDS)]
        self.able = able[able[self.known.chosen_by].notna()]
        chooses, tests = (errors[errors["side"] == side] for side in ("validation", "test"))
        here = tests[tests["split"] == self.split]
        _check(self.scene, self.able, here)
        self.errors = errors[errors["split"] == self.split].groupby(["model", "setting"])
        index = self.able.index
        self.means = resampled(tests, column).reindex(index).fillna(resampled(here, column).reindex(index))
        drawn = resampled(chooses[chooses["split"] == self.split], column).reindex(index)
        self.highest = drawn.quantile(RANGE[1], axis=1).reindex(index)

    def within(self, budget_ms: float) -> Advice:
        """Choose the most accurate of what answers in time."""
        none = Advice(self.scene, self.kind, self.split, budget_ms, np.nan, reference_error=self.known.own)
        fits = self.able[1e3 * self.able["online_p95_s"] <= (1 - MARGIN) * budget_ms]
        if fits.empty:
            return none._replace(why=reasons.late(self.able, self.known, budget_ms))
        best, rival = choice(fits, by_error(self.known.chosen_by), self.known.choosing)
        least = self.means.loc[fits.index].min().clip(lower=self.known.floor)
        sure = float((self.means.loc[best.name] <= EQUAL * least).mean())
        return none._replace(
            **self._said(best),
            **versus(best, rival, self.known.column, self.known.floor),
            margin=1 - 1e3 * best["online_p95_s"] / budget_ms,
            confidence=sure,
            why=reasons.within(best, rival, sure, fits, self.known, budget_ms),
        )

    def under(self, max_error: float) -> Advice:
        """Choose the fastest of what is surely accurate enough; none where the truth is not known that well."""
        none = Advice(self.scene, self.kind, self.split, np.nan, max_error, reference_error=self.known.own)
        if max_error < self.known.own:
            return none._replace(why=reasons.unknown(self.able, self.known))
        fits = self.able[(self.highest <= max_error).to_numpy()]
        if fits.empty:
            return none._replace(why=reasons.wrong(self.able, self.highest, self.known, max_error))
        best, rival = choice(fits, by_time(self.known.chosen_by), self.known.choosing)
        passed = passed_over(self.able, self.highest, best, "online_median_s", max_error, self.known.chosen_by)
        said = self._said(best)
        return none._replace(
            **said,
            **versus(best, rival, "online_median_s"),
            **passed,
            margin=1 - said["error_high"] / max_error,
            confidence=float((self.means.loc[best.name] <= max_error).mean()),
            why=reasons.under(best, rival, passed, fits, self.known, max_error),
        )

    def _said(self, best: pd.Series) -> dict:
        low, high = self.means.loc[best.name].quantile(list(RANGE))
        copied = ("model", "setting", *KINDS.values(), "p95_of_peak", "online_p95_s")
        found = {name: best[name] for name in copied} | {"validation_error": best[self.known.chosen_by]}
        asked = self.errors.get_group(best.name)
        bound = finite(bound_factor(asked[self.known.column].to_numpy(), asked["contact"].to_numpy()))
        return found | {"error_low": low, "error_high": high, "bound_of_peak": bound}


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
