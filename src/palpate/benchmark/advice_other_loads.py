"""Advise which model to take for a scene that moves, and for a kind of load that nothing was prepared for."""

from collections.abc import Callable, Sequence
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
from palpate.benchmark.conformal import FEWEST, finite
from palpate.benchmark.error_bounds import CONSTANT
from palpate.benchmark.ranking import EQUAL, KINDS, TIED_TIMES, by_error, by_time, fields_of, own_error
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
    error: str = "rms",
    together: bool = False,
) -> pd.DataFrame:
    """Tabulate advice.csv of a scene that moves, a row for each budget [ms], error [of its peak] and speed.

    motions : its rows of dynamic_accuracy.csv; bounds : its rows of motion_bounds.csv, if there are any
    speeds : seconds of motion that shall be computed in a second, or more
    pressed : accuracy_vs_time.csv, whose presses show how wrong the standard's mesh is
    error : "rms", of the displacement, or "force", of the instruments' force, which then stands in ``rmse_of_peak``
    together : whether the one error and the one speed are both meant, in one row
    A budget is for a step: of what runs in real time, and with 95 % of its steps within the budget, MARGIN of both left
    unused, the least wrong is taken, and likewise of what runs as fast as asked; of what is less wrong than an error,
    the standard's own added, the fastest, whether it keeps up or not. No error is promised below the standard's own, or
    where that is not known.
    Such a scene has one load, so nothing can be drawn anew: interval and confidence stay empty. The bound is of pushes
    elsewhere, and its factor is that of ``constant`` in ``bounds``.
    """
    # modes for another place show what that costs, and nobody who knows the place takes them
    able = motions[(motions["failures"] == 0) & (motions["varied"] != "place")]
    if error == "force":  # how wrong the standard's mesh is in it no press shows
        felt = able.dropna(subset="force_rms_of_peak")
        able = felt.assign(rmse_of_peak=felt["force_rms_of_peak"], reference_error=felt["reference_force_error"])
        bounds = pressed = None
    # such a scene is not divided, and has no patch
    none = {"scene": motions["scene"].iloc[0], "error": error, "split": 0, "model": NONE}
    limits = [{"budget_ms": budget} for budget in budgets_ms] + [{"max_error": limit} for limit in max_errors]
    limits += [{"speed": speed} for speed in speeds]
    if together:
        limits = [{"max_error": max_errors[0], "speed": speeds[0]}]
    first = motions.iloc[0]
    none |= {"over": _over(first)}
    rows = [none | each for each in limits]
    if said := parted(first):
        why = f"no error of a model is known, as {said}"
        return ADVICE.frame(row | {"why": why} for row in rows)
    if able.empty:
        why = f"no model got through the scene{' and told a force' if error == 'force' else ''}"
        return ADVICE.frame(row | {"why": why} for row in rows)
    able = able.assign(own_error=_own(able, pressed), error=error)
    own = {"reference_error": able["own_error"].iloc[0]}
    return ADVICE.frame(row | own | _asked(row)(able, row, bounds) for row in rows)


def _asked(limit: dict) -> Callable[[pd.DataFrame, dict, pd.DataFrame | None], dict]:
    """Return what chooses under a limit."""
    if "max_error" not in limit:
        return _within
    return _both if "speed" in limit else _under


def parted(first: pd.Series) -> str:
    """Return why no error of a model is known in a scene, or nothing; first : a row of dynamic_accuracy.csv."""
    said = first.get("parted")
    return said if isinstance(said, str) else ""


def _over(first: pd.Series) -> str:
    """Return what of a scene errors are taken over, in words; first : a row of dynamic_accuracy.csv."""
    until, whole = first.get("resolved_s", np.nan), first.get("duration_s", np.nan)
    return f"the first {until:.3g} of {whole:.3g} s" if until < whole * (1 - 1e-9) else "the whole motion"


class MeshError(NamedTuple):
    """Least and largest mean error of a level over the regimes of a body, of the peak: everywhere, at the patch."""

    low: float
    high: float
    patch_low: float
    patch_high: float


TRUTH = "fem_p2"
"""What dynamic_accuracy.csv calls a reference that is a truth: the limit of these elements."""
ELEMENTS = "fem_p1"
"""The elements of the standard that motions are compared with, among the models of accuracy_vs_time.csv."""


def mesh_error(pressed: pd.DataFrame | None, body: str, level: int) -> MeshError | None:
    """Return the error of converged linear elements of a level against the truth of presses, None if it is not known.

    pressed : accuracy_vs_time.csv, None if there is none
    """
    if pressed is None:
        return None
    rows = pressed[(pressed["model"] == ELEMENTS) & (pressed["body"] == body)]
    told = fields_of(rows, "level", "tolerance")
    exact = told["tolerance"].where(told["level"] == level)
    rows = rows[exact == exact.min()]
    if rows.empty:
        return None
    means = rows.groupby("scene")[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    surface, patch = means["rmse_of_peak"], means["patch_rms_of_peak"]
    return MeshError(surface.min(), surface.max(), patch.min(), patch.max())


def _own(able: pd.DataFrame, pressed: pd.DataFrame | None) -> float:
    """Return the own error of what errors are from; NaN: not known.

    That of a truth is its own; the standard's is what other meshes say or, if none were tried, that of its mesh, the
    largest over presses, and of its step.
    """
    first = able.iloc[0]
    if first["reference"] == TRUTH or np.isfinite(first.get("reference_error", np.nan)):
        return float(first["reference_error"])
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
            f"{least['step_p95_ms']:.3g} ms a step at the 95th percentile, {least['step_max_ms']:.3g} ms at most, "
            f"{used.min() / (1 - MARGIN):.3g} times what leaves {percent(MARGIN)} unused"
        )
        return _near(least) | {"why": why}
    reason = f"least error of {counted(fits)} that run {what} and leave {100 * MARGIN:.0f} % of it unused"
    best, row = _chosen(able, fits, BY_ERROR, reason, bounds)
    return row | {"margin": 1 - used[best.name]}


def _under(able: pd.DataFrame, limit: dict, bounds: pd.DataFrame | None) -> dict:
    """Choose the fastest setting whose error, the standard's own added, is within ``limit``."""
    bounded, max_error = able["rmse_of_peak"] + able["own_error"], limit["max_error"]
    nearest = able.loc[able["rmse_of_peak"].idxmin()]
    near = _near(nearest)
    fits = able[bounded <= max_error]
    if fits.empty:
        pace = f"{nearest['real_time_factor']:.2g} s for a second of motion"
        distance = f"{percent(nearest['rmse_of_peak'])} from the standard, {_mesh(able)}, and takes {pace}"
        why = f"the setting of least error, {name(nearest)}, is {distance}"
        if max_error < (own := able["own_error"].iloc[0]):
            why = f"no error below {percent(own)} can be told, the own error of what errors are from; {why}"
        return near | {"why": why}
    reason = f"fastest of {counted(fits)} whose error, the standard's own added, stays below {percent(max_error)}"
    best, row = _chosen(able, fits, BY_TIME, reason, bounds)
    return row | {"margin": 1 - bounded[best.name] / max_error}


def _both(able: pd.DataFrame, limit: dict, bounds: pd.DataFrame | None) -> dict:
    """Choose the setting of least error that is as fast as ``limit`` says, if that is within its error, too."""
    row, max_error = _within(able, {"speed": limit["speed"]}, bounds), limit["max_error"]
    if "model" not in row:
        return row
    error = row["rmse_of_peak"] + row["reference_error"]
    if error <= max_error:
        return row | {"margin": 1 - error / max_error}
    best = able[(able["model"] == row["model"]) & (able["setting"] == row["setting"])].iloc[0]
    return _near(best) | {"why": f"{row['why']}; with the standard's own its error is above {percent(max_error)}"}


def _near(setting: pd.Series) -> dict:
    """Return the columns of ADVICE about what comes nearest."""
    error = setting["rmse_of_peak"]
    found = {"nearest": setting["model"], "nearest_setting": setting["setting"]}
    found |= {"nearest_error": np.nansum([error, setting["own_error"]]), "nearest_s": 1e-3 * setting["step_p95_ms"]}
    return found | {"nearest_bound": error + setting["own_error"]}


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
        "online_max_s": 1e-3 * best["step_max_ms"],
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
    if able["reference"].iloc[0] == TRUTH:
        return f"the limit of quadratic elements, which is {percent(own)} wrong itself"
    mesh = f"mesh (level {able['reference_level'].iloc[0]:g})"
    if able["error"].iloc[0] == "force" and np.isnan(own):
        return f"which feels wrongly itself by what is not known, by its {mesh}"
    if np.isnan(own):
        tried = "no other mesh of this scene was tried, and no press of this body measured"
        return f"whose own error is not known, as {tried} on its {mesh}"
    if np.isfinite(able.iloc[0].get("reference_error", np.nan)):
        return f"which is {percent(own)} wrong itself, as another mesh and shorter steps say"
    return f"which is {percent(own)} wrong itself, by its {mesh} and its step"


class _Limit(NamedTuple):
    """The thing asked for: a largest error, or a budget of time [ms]."""

    max_error: float | None
    budget_ms: float | None

    @property
    def text(self) -> str:
        if self.max_error is not None:
            return f"an error of at most {percent(self.max_error)}"
        return f"{self.budget_ms:g} ms"

    def met(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return the ``rows`` that meet it."""
        if self.max_error is not None:
            return rows[rows["bound_of_peak"] <= self.max_error]
        return rows[1e3 * rows["online_max_s"] <= (1 - MARGIN) * float(self.budget_ms or 0)]

    def chosen(self, rows: pd.DataFrame) -> tuple[pd.Series, pd.Series | None]:
        """Return the fastest, or the least wrong, and the best of the other models."""
        return choice(rows, by_time("bound_of_peak") if self.max_error is not None else by_error(_judged_by(rows)))

    def nearest(self, rows: pd.DataFrame) -> pd.Series:
        """Return what of the ``rows``, none of which meets it, comes nearest."""
        return rows.loc[rows[_judged_by(rows) if self.max_error is not None else "online_max_s"].idxmin()]

    def compared(self, rows: pd.DataFrame) -> str:
        """Return the column by which the best of the ``rows`` and its rival are compared."""
        return "online_median_s" if self.max_error is not None else _judged_by(rows)


def _judged_by(rows: pd.DataFrame) -> str:
    """Return the column of the bounds, or where no row has one that of the mean errors."""
    return "bound_of_peak" if np.isfinite(rows["bound_of_peak"]).any() else "error_of_peak"


OPERATOR = "fem_p2"
"""The elements of the fine operator among the models of accuracy_vs_time.csv."""


def operator_error(pressed: pd.DataFrame, column: str) -> float:
    """Return how wrong the fine operator is, of the peak: its distance from the truth, and the truth's own error.

    pressed : the scene's rows of accuracy_vs_time.csv; column : one of KINDS
    The mean over test samples of the most exact setting of OPERATOR on its finest level that was measured; NaN where
    there is none, or no truth.
    """
    rows = pressed[(pressed["model"] == OPERATOR) & (pressed["failures"] == 0)]
    told = fields_of(rows, "level", "start", "tolerance", "target")
    told = told[(told["start"] == "rest") & told["target"].isna()][["level", "tolerance"]].dropna()
    told = told.sort_values(["level", "tolerance"], ascending=[False, True])
    if told.empty:
        return np.nan
    finest = told.index[(told == told.iloc[0]).all(axis=1)]
    return float(rows.loc[finest, column].mean()) + own_error(pressed, column)


def advise_any_load(
    rows: pd.DataFrame,
    kind: str,
    budget_ms: float | None = None,
    max_error: float | None = None,
    error: str = "rms",
    own: float = np.nan,
) -> pd.Series:
    """Choose from the ``rows`` of any_load.csv of one scene, for one ``kind`` of load.

    own : ``operator_error``, which is added to errors that are compared with ``max_error``; NaN where not known
    Returns scene, kind, model, setting, why, and of the model, or if that is "none" of ``nearest``, nearest_setting
        error_of_peak, most, own_of_peak : mean and largest distance from the fine operator, and its own error
        bound_of_peak : below which nine answers in ten at another place stay; NaN below FEWEST contacts
        contacts, samples, doubted : places answered, loads asked, and how many of these it said that it cannot answer
        force_error : of the force of a disc that is pushed to a depth
        online_p95_s, online_max_s, preparation_s, offline_s : of an answer, of the slowest load, for one press
            beforehand, and of all contacts, once

    The rule is that of ``advice``: of what answered all loads the fastest with a bound below ``max_error``, or the
    least bound, or mean error where there is no bound, of what answers the slowest load in ``budget_ms`` [ms] less
    MARGIN. If none does: of what says which loads it cannot answer, and answers the others so, what doubts fewest.
    A setting that failed without saying so before is never advised. The bound is the largest error: from FEWEST
    contacts on, nine in ten others stay below it.
    error : one of KINDS. Raises InputError for a kind that the table does not have.
    """
    scene, limit, column = rows["scene"].iloc[0], _Limit(max_error, budget_ms), KINDS[error]
    answers = rows[rows["kind"] == kind]
    if answers.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    if max_error is None and budget_ms is None:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    able = answers[(answers["refused"] == 0) & (answers["failures"] == 0) & (answers["contacts"] > 0)]
    bound = np.where(able["contacts"] >= FEWEST, able[f"{column}_most"] + np.nan_to_num(own), np.inf)
    able = able.assign(error_of_peak=able[column], most=able[f"{column}_most"], own_of_peak=own, bound_of_peak=bound)
    fits, unsure = limit.met(able[able["doubted"] == 0]), limit.met(able[able["doubted"] > 0])
    refused = sorted(set(answers["model"]) - set(answers.loc[answers["refused"] == 0, "model"]))
    refusals = f"; refused by {', '.join(refused)}" if refused else ""
    if fits.empty and unsure.empty:
        found = {"scene": scene, "kind": kind, "model": NONE, "setting": "", "nearest": ""}
        if not able.empty:
            close = limit.nearest(able)
            found |= {"nearest": close["model"], "nearest_setting": close["setting"]} | _copied(close)
        return pd.Series(found | {"why": f"{_none(able, limit)}, so that nothing meets {limit.text}{refusals}"})
    if fits.empty:
        fits = unsure[unsure["doubted"] == unsure["doubted"].min()]
        best, rival = limit.chosen(fits)
        also = f"; nothing that answers all of them meets {limit.text}"
    else:
        best, rival = limit.chosen(fits)
        also = _unsure(unsure, best, limit, fits)
    why = f"{_first(fits, limit)}; {next_best(rival, best, limit.compared(fits))}{also}{refusals}"
    found = {"scene": scene, "kind": kind, "model": best["model"], "setting": best["setting"]}
    return pd.Series(found | _copied(best) | {"why": why})


def _copied(best: pd.Series) -> dict:
    """Return the columns that ``advise_any_load`` has of its model, or of what comes nearest."""
    names = (
        "error_of_peak", "most", "own_of_peak", "force_error", "online_p95_s", "online_max_s", "preparation_s",
        "offline_s", "contacts", "samples", "doubted",
    )  # fmt: skip
    return {key: best[key] for key in names} | {"bound_of_peak": finite(best["bound_of_peak"])}


def doubts(row: pd.Series) -> str:
    """Return how many of the loads are doubted: "doubts 1 of 2 loads"; nothing where none is."""
    return f"doubts {row.doubted} of {row.samples} loads" if row.doubted else ""


def _first(fits: pd.DataFrame, limit: _Limit) -> str:
    if limit.max_error is not None:
        return f"fastest of {counted(fits)} of which nine answers in ten stay below {percent(limit.max_error)}"
    least = "least bound" if _judged_by(fits) == "bound_of_peak" else "least mean error"
    return f"{least} of {counted(fits)} whose slowest load leaves {percent(MARGIN)} of {limit.text} unused"


def _none(able: pd.DataFrame, limit: _Limit) -> str:
    if able.empty:
        return "no setting has answered all loads"
    close = limit.nearest(able)
    if limit.max_error is None:
        return f"the fastest setting, {name(close)}, takes {1e3 * close['online_max_s']:.3g} ms for its slowest load"
    if np.isfinite(close["bound_of_peak"]):
        return f"the setting of least bound, {name(close)}, has {percent(close['bound_of_peak'])}"
    return f"a bound needs answers at {FEWEST} contacts, and no setting has them at more than {able['contacts'].max()}"


def _unsure(unsure: pd.DataFrame, best: pd.Series, limit: _Limit, fits: pd.DataFrame) -> str:
    """Name what is clearly better where it answers, and was passed over as it does not answer all; or nothing."""
    if unsure.empty:
        return ""
    (other, _), column = limit.chosen(unsure), limit.compared(fits)
    factor, (tie, what) = ratio(best, other, column), tie_of(column)
    if factor <= tie:
        return ""
    return f"; {name(other)} has {1 / factor:.2g} of the {what} and was passed over, as it {doubts(other)}"
