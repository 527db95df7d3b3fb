"""Advise which model to take for a kind of load: at a prepared contact, at a new place, at two contacts, to a depth."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.errors import InputError
from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_choice import choice
from palpate.evaluation.tradeoff.advice_reasons import MARGIN, counted, name, percent
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL, KINDS, by_error, by_time


class AnyLoadAdvice(NamedTuple):
    """The choice for one kind of load in one scene; of model "none" nothing is known but ``why``.

    error_of_peak : mean over the loads; most : the largest of them; force_error : of a disc pushed to a depth
    preparation_s : for one press, beforehand; offline_s : of all contacts, once
    """

    scene: str
    kind: str
    model: str = NONE
    setting: str = ""
    error_of_peak: float = np.nan
    most: float = np.nan
    force_error: float = np.nan
    online_p95_s: float = np.nan
    preparation_s: float = np.nan
    offline_s: float = np.nan
    why: str = ""


def advise_any_load(
    rows: pd.DataFrame, kind: str, budget_ms: float | None = None, max_error: float | None = None, error: str = "rms"
) -> AnyLoadAdvice:
    """Choose from the ``rows`` of any_load.csv of one scene, for one ``kind`` of load.

    Of what answered all loads: the fastest whose largest error stays below ``max_error``, or the least wrong whose
    time leaves MARGIN of ``budget_ms`` [ms] free. The loads are few, so the largest error stands for draws of them.
    error : one of KINDS. Raises InputError for a kind that the table does not have.
    """
    scene, column = rows["scene"].iloc[0], KINDS[error]
    asked = rows[rows["kind"] == kind]
    if asked.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    most = f"{column}_most"
    able = asked[(asked["refused"] == 0) & (asked["failures"] == 0)]
    if max_error is not None:
        fits, by = able[able[most] <= max_error], by_time(column)
        limit, said = f"error of at most {percent(max_error)}", f"whose largest error stays below {percent(max_error)}"
    elif budget_ms is not None:
        fits, by = able[1e3 * able["online_p95_s"] <= (1 - MARGIN) * budget_ms], by_error(column)
        limit, said = f"{budget_ms:g} ms", f"whose 95th percentile leaves {percent(MARGIN)} of {budget_ms:g} ms unused"
    else:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    refused = sorted(set(asked["model"]) - set(asked.loc[asked["refused"] == 0, "model"]))
    told = f"; refused by {', '.join(refused)}" if refused else ""
    if fits.empty:
        return AnyLoadAdvice(scene, kind, why=f"{_none(able, column, most)}, so that nothing meets {limit}{told}")
    best, rival = choice(fits, by)
    first = "fastest" if max_error is not None else "least wrong"
    why = f"{first} of {counted(fits)} {said}; {_next(best, rival, column, max_error is not None)}{told}"
    copied = {
        key: best[key] for key in ("model", "setting", "force_error", "online_p95_s", "preparation_s", "offline_s")
    }
    return AnyLoadAdvice(scene, kind, **copied, error_of_peak=best[column], most=best[most], why=why)


def _none(able: pd.DataFrame, column: str, most: str) -> str:
    if able.empty:
        return "no setting has answered all loads"
    least = able.loc[able[most].idxmin()]
    return (
        f"the setting of least error, {name(least)}, has {percent(least[column])}, at most {percent(least[most])}, in "
        f"{1e3 * least['online_p95_s']:.3g} ms"
    )


def _next(best: pd.Series, rival: pd.Series | None, column: str, timed: bool) -> str:
    """Name the next best model, and how far it is behind."""
    if rival is None:
        return "no other model meets the limit"
    compared, tie, what = ("online_median_s", CLOSE, "time") if timed else (column, EQUAL, "error")
    factor = rival[compared] / best[compared]
    behind = "is equal within the spread of runs" if factor <= tie else f"has {factor:.3g} times the {what}"
    return f"the next best model, {name(rival)}, {behind}"
