"""Advise which model to take for a kind of load: at a prepared contact, at a new place, at two contacts, to a depth."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import CLOSE, EQUAL, KINDS, by_error, by_time
from palpate.errors import InputError
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_choice import choice
from palpate.studies.tradeoff.advice_reasons import MARGIN, counted, name, percent


class AnyLoadAdvice(NamedTuple):
    """The choice for one kind of load in one scene; of model "none" nothing is known but ``why``.

    error_of_peak : mean over the loads that were answered; force_error : of a disc pushed to a depth
    most : the largest error of them, which stays above that of an answer at another place in the share ``sure`` of
        the cases: of n places and a new one each may be the worst (``conformal``)
    samples : the loads that were asked; doubted : how many of them the model has said that it cannot answer
    preparation_s : for one press, beforehand; offline_s : of all contacts, once
    """

    scene: str
    kind: str
    model: str = NONE
    setting: str = ""
    error_of_peak: float = np.nan
    most: float = np.nan
    sure: float = np.nan
    samples: int = 0
    doubted: int = 0
    force_error: float = np.nan
    online_p95_s: float = np.nan
    preparation_s: float = np.nan
    offline_s: float = np.nan
    why: str = ""


class _Limit(NamedTuple):
    """The thing asked for: a largest error, or a budget of time [ms]; ``column`` is that of the error."""

    column: str
    max_error: float | None
    budget_ms: float | None

    @property
    def most(self) -> str:
        return f"{self.column}_most"

    @property
    def text(self) -> str:
        if self.max_error is not None:
            return f"an error of at most {percent(self.max_error)}"
        return f"{self.budget_ms:g} ms"

    def met(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return the ``rows`` that meet it; the loads are few, so the largest error stands for draws of them."""
        if self.max_error is not None:
            return rows[rows[self.most] <= self.max_error]
        return rows[1e3 * rows["online_p95_s"] <= (1 - MARGIN) * float(self.budget_ms or 0)]

    def chosen(self, rows: pd.DataFrame) -> tuple[pd.Series, pd.Series | None]:
        """Return the fastest, or the least wrong, and the best of the other models."""
        return choice(rows, by_time(self.column) if self.max_error is not None else by_error(self.column))

    def behind(self, rival: pd.Series, best: pd.Series) -> tuple[float, float, str]:
        """Return how many times as much time or error the rival has, what counts as equal, and which it is."""
        compared, tie, what = (
            ("online_median_s", CLOSE, "time") if self.max_error is not None else (self.column, EQUAL, "error")
        )
        return rival[compared] / best[compared], tie, what


def advise_any_load(
    rows: pd.DataFrame, kind: str, budget_ms: float | None = None, max_error: float | None = None, error: str = "rms"
) -> AnyLoadAdvice:
    """Choose from the ``rows`` of any_load.csv of one scene, for one ``kind`` of load.

    Of what answered all loads: the fastest whose largest error stays below ``max_error``, or the least wrong whose
    time leaves MARGIN of ``budget_ms`` [ms] free. If none does: of what says which loads it cannot answer, and answers
    the others so, what doubts fewest. A setting that failed without saying so before is never advised.
    error : one of KINDS. Raises InputError for a kind that the table does not have.
    """
    scene, limit = rows["scene"].iloc[0], _Limit(KINDS[error], max_error, budget_ms)
    asked = rows[rows["kind"] == kind]
    if asked.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    if max_error is None and budget_ms is None:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    able = asked[(asked["refused"] == 0) & (asked["failures"] == 0) & (asked["contacts"] > 0)]
    fits, unsure = limit.met(able[able["doubted"] == 0]), limit.met(able[able["doubted"] > 0])
    refused = sorted(set(asked["model"]) - set(asked.loc[asked["refused"] == 0, "model"]))
    told = f"; refused by {', '.join(refused)}" if refused else ""
    if fits.empty and unsure.empty:
        return AnyLoadAdvice(scene, kind, why=f"{_none(able, limit)}, so that nothing meets {limit.text}{told}")
    if fits.empty:
        fits = unsure[unsure["doubted"] == unsure["doubted"].min()]
        best, rival = limit.chosen(fits)
        also = f"; nothing that answers all of them meets {limit.text}"
    else:
        best, rival = limit.chosen(fits)
        also = _unsure(unsure, best, limit)
    why = f"{_first(fits, limit)}; {_next(best, rival, limit)}{also}{told}"
    copied = ("model", "setting", "force_error", "online_p95_s", "preparation_s", "offline_s", "samples", "doubted")
    found = {key: best[key] for key in copied} | {"error_of_peak": best[limit.column], "most": best[limit.most]}
    return AnyLoadAdvice(scene, kind, **found, sure=float(best["contacts"] / (best["contacts"] + 1)), why=why)


def doubts(row: pd.Series | AnyLoadAdvice) -> str:
    """Return how many of the loads are doubted: "doubts 1 of 2 loads"; nothing where none is."""
    return f"doubts {row.doubted} of {row.samples} loads" if row.doubted else ""


def _first(fits: pd.DataFrame, limit: _Limit) -> str:
    if limit.max_error is not None:
        return f"fastest of {counted(fits)} whose largest error stays below {percent(limit.max_error)}"
    left = f"leaves {percent(MARGIN)} of {limit.text} unused"
    return f"least wrong of {counted(fits)} whose 95th percentile {left}"


def _none(able: pd.DataFrame, limit: _Limit) -> str:
    if able.empty:
        return "no setting has answered all loads"
    least = able.loc[able[limit.most].idxmin()]
    doubted = f", {doubts(least)}" if doubts(least) else ""
    return (
        f"the setting of least error, {name(least)}, has {percent(least[limit.column])}, at most "
        f"{percent(least[limit.most])}, in {1e3 * least['online_p95_s']:.3g} ms{doubted}"
    )


def _next(best: pd.Series, rival: pd.Series | None, limit: _Limit) -> str:
    """Name the next best model, and how far it is behind."""
    if rival is None:
        return "no other model meets the limit"
    factor, tie, what = limit.behind(rival, best)
    behind = "is equal within the spread of runs" if factor <= tie else f"has {factor:.3g} times the {what}"
    return f"the next best model, {name(rival)}, {behind}"


def _unsure(unsure: pd.DataFrame, best: pd.Series, limit: _Limit) -> str:
    """Name what is clearly better where it answers, and was passed over as it does not answer all; or nothing."""
    if unsure.empty:
        return ""
    other, _ = limit.chosen(unsure)
    factor, tie, what = limit.behind(best, other)
    if factor <= tie:
        return ""
    return f"; {name(other)} has {1 / factor:.2g} of the {what} and was passed over, as it {doubts(other)}"
