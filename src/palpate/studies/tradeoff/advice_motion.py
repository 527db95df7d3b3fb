"""Advise which model to take for a scene that moves: by its error, its speed, or the time of its steps."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import CLOSE, EQUAL
from palpate.benchmark.error_bounds import CONSTANT
from palpate.studies.tradeoff import advice_reasons as reasons
from palpate.studies.tradeoff.advice import Advice
from palpate.studies.tradeoff.advice_choice import choice, passed_over, versus
from palpate.studies.tradeoff.advice_reasons import MARGIN, counted, name, next_best, percent

BY_ERROR = {"rmse_of_peak": EQUAL, "real_time_factor": CLOSE}
BY_TIME = {"real_time_factor": CLOSE, "rmse_of_peak": EQUAL}
MOVING = ("rms", 0)
"""Kind of error and split of a scene that moves: it is not divided, and has no patch."""


def advise_motion(
    motions: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    speeds: Sequence[float] = (),
    bounds: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Tabulate advice.csv of a scene that moves, an ``Advice`` for each budget [ms], error [of its peak] and speed.

    motions : its rows of dynamic_accuracy.csv; bounds : its rows of motion_bounds.csv, if there are any
    speeds : seconds of motion that shall be computed in a second, or more
    A budget is for a step: of what runs in real time, and with 95 % of its steps within the budget, MARGIN of both left
    unused, the least wrong is taken, and likewise of what runs as fast as asked; of what is less wrong than an error,
    what the reference's last halving changed added, the fastest, whether it keeps up or not.
    Such a scene has one load, so nothing can be drawn anew: interval and confidence stay empty. The bound is of pushes
    elsewhere, and its factor is that of ``constant`` in ``bounds``.
    """
    scene = motions["scene"].iloc[0]
    # modes for another place show what that costs, and nobody who knows the place takes them
    able = motions[(motions["failures"] == 0) & (motions["varied"] != "place")]
    if able.empty:
        none = Advice(scene, *MOVING, np.nan, np.nan, why="no model got through the scene")
        rows = [none._replace(budget_ms=budget) for budget in budgets_ms]
        rows += [none._replace(max_error=limit) for limit in max_errors]
        rows += [none._replace(speed=speed) for speed in speeds]
    else:
        rows = [_within(able, scene, budget, bounds=bounds) for budget in budgets_ms]
        rows += [_under(able, scene, limit, bounds) for limit in max_errors]
        rows += [_within(able, scene, np.nan, speed, bounds) for speed in speeds]
    return pd.DataFrame(rows, columns=Advice._fields)


def _within(
    able: pd.DataFrame, scene: str, budget_ms: float, speed: float = np.nan, bounds: pd.DataFrame | None = None
) -> Advice:
    none = Advice(scene, *MOVING, budget_ms, np.nan, speed=speed, reference_error=_own(able))
    if np.isfinite(speed):
        used, what = speed * able["real_time_factor"], f"{speed:g} times as fast as life"
    else:
        used, what = np.maximum(able["real_time_factor"], able["step_p95_ms"] / budget_ms), "in real time"
    fits = able[used <= 1 - MARGIN]
    if fits.empty:
        return none._replace(why=_late(able, used))
    best, rival = choice(fits, BY_ERROR)
    said = f"least error of {counted(fits)} that run {what} and leave {100 * MARGIN:.0f} % of it unused"
    found = _told(best, bounds) | versus(best, rival, "rmse_of_peak")
    why = f"{_why(said, best, rival, 'rmse_of_peak')}; {_mesh(able)}"
    return none._replace(**found, margin=1 - used[best.name], why=why)


def _under(able: pd.DataFrame, scene: str, max_error: float, bounds: pd.DataFrame | None) -> Advice:
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
    found = _told(best, bounds) | versus(best, rival, "real_time_factor") | passed
    said = f"fastest of {counted(fits)} whose error, {own}, stays below {percent(max_error)}"
    why = _why(said, best, rival, "real_time_factor")
    why = "; ".join([why, *reasons.passed_over(passed, "the reference's own added"), _mesh(able)])
    margin = 1 - known[best.name] / max_error
    return Advice(scene, *MOVING, np.nan, max_error, **found, margin=margin, why=why)


def _told(best: pd.Series, bounds: pd.DataFrame | None) -> dict:
    bound, measured = bound_elsewhere(best, bounds)
    return {key: best[key] for key in ("model", "setting", "rmse_of_peak", "p95_of_peak")} | {
        "online_p95_s": 1e-3 * best["step_p95_ms"],
        "reference_error": best["reference_change"],
        "times_life": 1.0 / best["real_time_factor"],
        "bound_of_peak": bound,
        "bound_on": measured,
    }


def bound_elsewhere(best: pd.Series, bounds: pd.DataFrame | None) -> tuple[float, str]:
    """Return the bound of a setting's error where the push is elsewhere, and what it was measured on, in words.

    Without a bound, NaN and the reason.
    """
    if bounds is None or bounds.empty:
        return np.nan, "the scene's own motion alone was measured"
    places = int(bounds["places"].max())
    told = bounds[bounds["estimate"] == CONSTANT].set_index(["model", "setting"])
    key = best["model"], best["setting"]
    if key not in told.index:
        return np.nan, f"this setting was not asked at the {places} other places"
    row = told.loc[key]
    if np.isnan(row["bound_of_peak"]):
        return np.nan, f"this setting answered at {row['places'] - row['failures']:g} of {places} other places"
    kept = f", where it held for {percent(row['coverage'])} of the places held out" * bool(np.isfinite(row["coverage"]))
    return float(row["bound_of_peak"]), f"{places} other places of the push{kept}"


def _own(able: pd.DataFrame) -> float:
    return float(able["reference_change"].iloc[0])


def _mesh(able: pd.DataFrame) -> str:
    return f"the error of the reference's mesh (level {able['reference_level'].iloc[0]:g}) is not in these"


def _why(said: str, best: pd.Series, rival: pd.Series | None, column: str) -> str:
    return "; ".join([said, f"{best['real_time_factor']:.2g} s for a second of motion", next_best(rival, best, column)])


def _late(able: pd.DataFrame, used: pd.Series) -> str:
    least = able.loc[used.idxmin()]
    return (
        f"the fastest setting, {name(least)}, takes {least['real_time_factor']:.2g} s for a second of motion and "
        f"{least['step_p95_ms']:.3g} ms a step at the 95th percentile"
    )
