"""Advise which model to take for a scene that moves: one that runs in real time, and whose steps fit a budget."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.evaluation.tradeoff import advice_reasons as reasons
from palpate.evaluation.tradeoff.advice import Advice
from palpate.evaluation.tradeoff.advice_choice import choice, passed_over, versus
from palpate.evaluation.tradeoff.advice_reasons import MARGIN, counted, name, next_best, percent
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL

BY_ERROR = {"rmse_of_peak": EQUAL, "real_time_factor": CLOSE}
BY_TIME = {"real_time_factor": CLOSE, "rmse_of_peak": EQUAL}
MOVING = ("rms", 0)
"""Kind of error and split of a scene that moves: it is not divided, and has no patch."""


def advise_motion(
    motions: pd.DataFrame, budgets_ms: Sequence[float] = (), max_errors: Sequence[float] = ()
) -> pd.DataFrame:
    """Tabulate advice.csv of a scene that moves, an ``Advice`` for each budget [ms] and largest error [of its peak].

    motions : its rows of dynamic_accuracy.csv
    A budget is for a step: of what runs in real time, and with 95 % of its steps within the budget, MARGIN of both left
    unused, the least wrong is taken; of what is less wrong than an error, what the reference's last halving changed
    added, the fastest, whether it keeps up or not.
    Such a scene has one load, so nothing can be drawn anew: interval and confidence stay empty.
    """
    able, scene = motions[motions["failures"] == 0], motions["scene"].iloc[0]
    if able.empty:
        limits = [(budget, np.nan) for budget in budgets_ms] + [(np.nan, limit) for limit in max_errors]
        rows = [Advice(scene, *MOVING, *limit, why="no model got through the scene") for limit in limits]
    else:
        rows = [_within(able, scene, budget) for budget in budgets_ms]
        rows += [_under(able, scene, limit) for limit in max_errors]
    return pd.DataFrame(rows, columns=Advice._fields)


def _within(able: pd.DataFrame, scene: str, budget_ms: float) -> Advice:
    used = np.maximum(able["real_time_factor"], able["step_p95_ms"] / budget_ms)
    fits = able[used <= 1 - MARGIN]
    if fits.empty:
        why = _late(able, used, budget_ms)
        return Advice(scene, *MOVING, budget_ms, np.nan, reference_error=_own(able), why=why)
    best, rival = choice(fits, BY_ERROR)
    said = f"least error of {counted(fits)} that run in real time and leave {100 * MARGIN:.0f} % of it unused"
    found = _told(best) | versus(best, rival, "rmse_of_peak")
    why = f"{_why(said, best, rival, 'rmse_of_peak')}; {_mesh(able)}"
    return Advice(scene, *MOVING, budget_ms, np.nan, **found, margin=1 - used[best.name], why=why)


def _under(able: pd.DataFrame, scene: str, max_error: float) -> Advice:
    known = able["rmse_of_peak"] + able["reference_change"]
    own = f"the reference's own {percent(_own(able))} added"
    fits = able[known <= max_error]
    if fits.empty:
        least = able.loc[known.idxmin()]
        why = (
            f"the setting of least error, {name(least)}, has {percent(least['rmse_of_peak'])}, which is "
            f"{percent(known.min())} with {own}"
        )
        if _own(able) >= max_error:
            why += "; a smaller dynamic.change_of_peak makes the reference more exact"
        return Advice(scene, *MOVING, np.nan, max_error, reference_error=_own(able), why=why)
    best, rival = choice(fits, BY_TIME)
    passed = passed_over(able, known, best, "real_time_factor", max_error)
    found = _told(best) | versus(best, rival, "real_time_factor") | passed
    said = f"fastest of {counted(fits)} whose error, {own}, stays below {percent(max_error)}"
    why = _why(said, best, rival, "real_time_factor")
    why = "; ".join([why, *reasons.passed_over(passed, "the reference's own added"), _mesh(able)])
    margin = 1 - known[best.name] / max_error
    return Advice(scene, *MOVING, np.nan, max_error, **found, margin=margin, why=why)


def _told(best: pd.Series) -> dict:
    return {key: best[key] for key in ("model", "setting", "rmse_of_peak", "p95_of_peak")} | {
        "online_p95_s": 1e-3 * best["step_p95_ms"],
        "reference_error": best["reference_change"],
    }


def _own(able: pd.DataFrame) -> float:
    return float(able["reference_change"].iloc[0])


def _mesh(able: pd.DataFrame) -> str:
    return f"the error of the reference's mesh (level {able['reference_level'].iloc[0]:g}) is not in these"


def _why(said: str, best: pd.Series, rival: pd.Series | None, column: str) -> str:
    return "; ".join([said, f"{best['real_time_factor']:.2g} s for a second of motion", next_best(rival, best, column)])


def _late(able: pd.DataFrame, used: pd.Series, budget_ms: float) -> str:
    least = able.loc[used.idxmin()]
    return (
        f"the fastest setting, {name(least)}, takes {least['real_time_factor']:.2g} s for a second of motion and "
        f"{least['step_p95_ms']:.3g} ms a step at the 95th percentile"
    )
