"""Advise which model to take for a scene that moves, and for a kind of load that nothing was prepared for."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.advice import (
    ADVICE,
    MARGIN,
    NONE,
    choice,
    counted,
    name,
    next_best,
    percent,
    ratio,
    tie_of,
    versus,
)
from palpate.benchmark.comparison import EQUAL, KINDS, TIED_TIMES, by_error, by_time
from palpate.benchmark.error_bounds import CONSTANT
from palpate.errors import InputError

BY_ERROR = {"rmse_of_peak": EQUAL, "real_time_factor": TIED_TIMES}
BY_TIME = {"real_time_factor": TIED_TIMES, "rmse_of_peak": EQUAL}


def advise_motion(
    motions: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    speeds: Sequence[float] = (),
    bounds: pd.DataFrame | None = None,
    pressed: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Tabulate advice.csv of a scene that moves, a row for each budget [ms], error [of its peak] and speed.

    motions : its rows of dynamic_accuracy.csv; bounds : its rows of motion_bounds.csv, if there are any
    speeds : seconds of motion that shall be computed in a second, or more
    pressed : accuracy_vs_time.csv, whose presses show how wrong the standard's mesh is
    A budget is for a step: of what runs in real time, and with 95 % of its steps within the budget, MARGIN of both left
    unused, the least wrong is taken, and likewise of what runs as fast as asked; of what is less wrong than an error,
    the standard's own added, the fastest, whether it keeps up or not. No error is promised below the standard's own, or
    where nobody knows that.
    Such a scene has one load, so nothing can be drawn anew: interval and confidence stay empty. The bound is of pushes
    elsewhere, and its factor is that of ``constant`` in ``bounds``.
    """
    # modes for another place show what that costs, and nobody who knows the place takes them
    able = motions[(motions["failures"] == 0) & (motions["varied"] != "place")]
    # such a scene is not divided, and has no patch
    none = {"scene": motions["scene"].iloc[0], "error": "rms", "split": 0, "model": NONE}
    limits = [{"budget_ms": budget} for budget in budgets_ms] + [{"max_error": limit} for limit in max_errors]
    rows = [none | each for each in (*limits, *({"speed": speed} for speed in speeds))]
    if able.empty:
        return ADVICE.frame(row | {"why": "no model got through the scene"} for row in rows)
    able = able.assign(own_error=_own(able, pressed))
    own = {"reference_error": able["own_error"].iloc[0]}
    return ADVICE.frame(row | own | (_under if "max_error" in row else _within)(able, row, bounds) for row in rows)


class MeshError(NamedTuple):
    """Least and largest mean error of a level over the regimes of a body, of the peak: everywhere, at the patch."""

    low: float
    high: float
    patch_low: float
    patch_high: float


ELEMENTS = "fem_p1"
"""The elements of the standard that motions are compared with, among the models of accuracy_vs_time.csv."""


def mesh_error(pressed: pd.DataFrame | None, body: str, level: int) -> MeshError | None:
    """Return the error of converged linear elements of a level against the truth of presses, None if it is not known.

    pressed : accuracy_vs_time.csv, None if there is none
    """
    if pressed is None:
        return None
    rows = pressed[(pressed["model"] == ELEMENTS) & (pressed["body"] == body)]
    rows = rows[rows["setting"].str.startswith(f"level={level}, ")]
    exact = rows["setting"].str.extract(r"tolerance=([0-9.e+-]+)", expand=False).astype(float)
    rows = rows[exact == exact.min()]
    if rows.empty:
        return None
    means = rows.groupby("scene")[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    surface, patch = means["rmse_of_peak"], means["patch_rms_of_peak"]
    return MeshError(surface.min(), surface.max(), patch.min(), patch.max())


def _own(able: pd.DataFrame, pressed: pd.DataFrame | None) -> float:
    """Return the own error of the standard, of its mesh (the largest over presses) and of its step; NaN: not known."""
    first = able.iloc[0]
    mesh = mesh_error(pressed, first["body"], int(first["reference_level"]))
    return np.nan if mesh is None else float(mesh.high + first["reference_change"])


def _within(able: pd.DataFrame, limit: dict, bounds: pd.DataFrame | None) -> dict:
    """Choose the setting of least error that is as fast as ``limit`` says, or within its budget of a step."""
    if "speed" in limit:
        used, what = limit["speed"] * able["real_time_factor"], f"at {limit['speed']:g} × real time"
    else:
        used = np.maximum(able["real_time_factor"], able["step_p95_ms"] / limit["budget_ms"])
        what = "in real time"
    fits = able[used <= 1 - MARGIN]
    if fits.empty:
        least = able.loc[used.idxmin()]
        why = (
            f"the fastest setting, {name(least)}, takes {least['real_time_factor']:.2g} s for a second of motion and "
            f"{least['step_p95_ms']:.3g} ms a step at the 95th percentile"
        )
        return {"why": why}
    reason = f"least error of {counted(fits)} that run {what} and leave {100 * MARGIN:.0f} % of it unused"
    best, row = _chosen(able, fits, BY_ERROR, reason, bounds)
    return row | {"margin": 1 - used[best.name]}


def _under(able: pd.DataFrame, limit: dict, bounds: pd.DataFrame | None) -> dict:
    """Choose the fastest setting whose error, the standard's own added, is within ``limit``."""
    bounded, max_error = able["rmse_of_peak"] + able["own_error"], limit["max_error"]
    nearest = able.loc[able["rmse_of_peak"].idxmin()]
    near = {"nearest": nearest["model"], "nearest_setting": nearest["setting"], "nearest_bound": bounded[nearest.name]}
    fits = able[bounded <= max_error]
    if fits.empty:
        distance = f"{percent(nearest['rmse_of_peak'])} from the standard, {_mesh(able)}"
        return near | {"why": f"the setting of least error, {name(nearest)}, is {distance}"}
    reason = f"fastest of {counted(fits)} whose error, the standard's own added, stays below {percent(max_error)}"
    best, row = _chosen(able, fits, BY_TIME, reason, bounds)
    return row | {"margin": 1 - bounded[best.name] / max_error}


def _chosen(
    able: pd.DataFrame, fits: pd.DataFrame, by: dict[str, float], reason: str, bounds: pd.DataFrame | None
) -> tuple[pd.Series, dict]:
    """Choose from ``fits``; return the choice, and what a row of ADVICE says of it, after ``reason``.

    by : what decides, as ``pick`` takes it; its first column is that in which the next best model is compared
    """
    (best, rival), column = choice(fits, by), next(iter(by))
    bound, measured = bound_elsewhere(best, bounds)
    pace = f"{best['real_time_factor']:.2g} s for a second of motion"
    why = "; ".join([reason, pace, next_best(rival, best, column), f"errors are from the standard, {_mesh(able)}"])
    row = {key: best[key] for key in ("model", "setting", "rmse_of_peak", "p95_of_peak")} | {
        "online_p95_s": 1e-3 * best["step_p95_ms"],
        "reference_error": best["own_error"],
        "times_life": 1.0 / best["real_time_factor"],
        "bound_of_peak": bound,
        "bound_on": measured,
        "why": why,
    }
    return best, row | versus(best, rival, column)


def bound_elsewhere(best: pd.Series, bounds: pd.DataFrame | None) -> tuple[float, str]:
    """Return the bound of a setting's error where the push is elsewhere, and what it was measured on, in words.

    Without a bound, NaN and the reason.
    """
    if bounds is None or bounds.empty:
        return np.nan, "the scene's own motion alone was measured"
    places = int(bounds["places"].max())
    constant = bounds[bounds["estimate"] == CONSTANT].set_index(["model", "setting"])
    key = best["model"], best["setting"]
    if key not in constant.index:
        return np.nan, f"this setting was not asked at the {places} other places"
    row = constant.loc[key]
    if np.isnan(row["bound_of_peak"]):
        return np.nan, f"this setting answered at {row['places'] - row['failures']:g} of {places} other places"
    kept = f", where it held for {percent(row['coverage'])} of the places held out" * bool(np.isfinite(row["coverage"]))
    return float(row["bound_of_peak"]), f"{places} other places of the push{kept}"


def _mesh(able: pd.DataFrame) -> str:
    own = able["own_error"].iloc[0]
    mesh = f"mesh (level {able['reference_level'].iloc[0]:g})"
    if np.isnan(own):
        return f"and how wrong that is itself nobody knows, as no press of this body was measured on its {mesh}"
    return f"which is {percent(own)} wrong itself, by its {mesh} and its step"


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

    @property
    def compared(self) -> str:
        """The column by which the best and its rival are compared."""
        return self.column if self.max_error is None else "online_median_s"


def advise_any_load(
    rows: pd.DataFrame, kind: str, budget_ms: float | None = None, max_error: float | None = None, error: str = "rms"
) -> pd.Series:
    """Choose from the ``rows`` of any_load.csv of one scene, for one ``kind`` of load.

    Returns scene, kind, model, setting and why, and unless the model is "none" (n places, of which a new one may be
    the worst, as in ``conformal``)
        error_of_peak, force_error : means over the loads that were answered, and of the force of a disc pushed so far
        most, sure : the largest error, and the share of answers at another place below which that stays: n / (n + 1)
        samples, doubted : the loads that were asked, and how many of them the model has said that it cannot answer
        online_p95_s, preparation_s, offline_s : of an answer, for one press beforehand, and of all contacts, once

    Of what answered all loads: the fastest whose largest error stays below ``max_error``, or the least wrong whose
    time leaves MARGIN of ``budget_ms`` [ms] free. If none does: of what says which loads it cannot answer, and answers
    the others so, what doubts fewest. A setting that failed without saying so before is never advised.
    error : one of KINDS. Raises InputError for a kind that the table does not have.
    """
    scene, limit = rows["scene"].iloc[0], _Limit(KINDS[error], max_error, budget_ms)
    answers = rows[rows["kind"] == kind]
    if answers.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    if max_error is None and budget_ms is None:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    able = answers[(answers["refused"] == 0) & (answers["failures"] == 0) & (answers["contacts"] > 0)]
    fits, unsure = limit.met(able[able["doubted"] == 0]), limit.met(able[able["doubted"] > 0])
    refused = sorted(set(answers["model"]) - set(answers.loc[answers["refused"] == 0, "model"]))
    refusals = f"; refused by {', '.join(refused)}" if refused else ""
    if fits.empty and unsure.empty:
        why = f"{_none(able, limit)}, so that nothing meets {limit.text}{refusals}"
        return pd.Series({"scene": scene, "kind": kind, "model": NONE, "setting": "", "why": why})
    if fits.empty:
        fits = unsure[unsure["doubted"] == unsure["doubted"].min()]
        best, rival = limit.chosen(fits)
        also = f"; nothing that answers all of them meets {limit.text}"
    else:
        best, rival = limit.chosen(fits)
        also = _unsure(unsure, best, limit)
    why = f"{_first(fits, limit)}; {next_best(rival, best, limit.compared)}{also}{refusals}"
    copied = ("model", "setting", "force_error", "online_p95_s", "preparation_s", "offline_s", "samples", "doubted")
    row = {key: best[key] for key in copied} | {"error_of_peak": best[limit.column], "most": best[limit.most]}
    row |= {"scene": scene, "kind": kind, "sure": best["contacts"] / (best["contacts"] + 1), "why": why}
    return pd.Series(row)


def doubts(row: pd.Series) -> str:
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


def _unsure(unsure: pd.DataFrame, best: pd.Series, limit: _Limit) -> str:
    """Name what is clearly better where it answers, and was passed over as it does not answer all; or nothing."""
    if unsure.empty:
        return ""
    other, _ = limit.chosen(unsure)
    factor, (tie, what) = ratio(best, other, limit.compared), tie_of(limit.compared)
    if factor <= tie:
        return ""
    return f"; {name(other)} has {1 / factor:.2g} of the {what} and was passed over, as it {doubts(other)}"
