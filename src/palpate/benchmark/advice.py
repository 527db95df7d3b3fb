"""Advise which model to take for presses, other loads, touches and motions, from the tables that measured them."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.choosing import BOUND, FASTEST, NONE, SETTING, TIED, Candidates, HeldOut, Limit, percent
from palpate.benchmark.conformal import CONSTANT, FEWEST, finite
from palpate.benchmark.ranking import (
    BOUNDS,
    EQUAL,
    EXACT,
    KINDS,
    RANGE,
    TIED_TIMES,
    TRUTH,
    fields_of,
    own_error,
    resampled,
    unknown,
)
from palpate.errors import InputError
from palpate.table_declaration import Table

ADVICE = Table(
    "advice",
    "The model and setting to take for each limit of time or error, the next best one, and the reason.",
    """
    scene error: what is asked about: a scene, and its "rms" error over the surface or at the "patch" that is pressed
    budget_ms max_error: the time of an answer [ms], or the error of nine answers in ten, that must not be passed; one
        of them is empty
    over: where a body moves, what of its motion errors are taken over
    model setting: what to take, or "none"
    rmse_of_peak patch_rms_of_peak: its mean errors over the test samples
    error_low error_high: between which the mean error lies in 5 to 95 % of draws of test contacts
    bound_of_peak: below which the error of a single answer at another contact stays in nine cases of ten, with the
        truth's own error: of the setting, or, if that is larger, of what is chosen in the same way without the contact
    contacts presses: how many contacts that it has not learnt from, and presses of them, the bound is of
    rejected rejected_answered: validation and test presses without a truth, of which no error is known, and those of
        them that it answered without a doubt or a failure
    p95_of_peak: 95th percentile of the error over the nodes
    online_median_s online_p95_s online_max_s: times of an answer: median and 95th percentile of single calls, and of
        the slowest press the median of its calls; where a body moves of a step, 95th percentile and largest
    offline_s memory_mb: of the preparation [s], and what it holds [1e6 bytes]
    margin: share of the budget that the slowest press leaves, or of max_error that the bound leaves
    confidence: where each contact is left out in turn, of a budget the share of contacts without which it is, or ties
        with, the least wrong that fits, of an error the share of the answers there that stay below it
    rival rival_setting factor: the choice without this model, and how many times its bound, or its time, that has
    reference_error: of the truth itself, below which models are tied; where a body moves, that of the standard
        (of its mesh and its step), which is added to what is compared with max_error
    faster faster_setting faster_error faster_high faster_factor: what is this many times as fast and was passed over,
        its mean error, and its bound
    nearest nearest_setting nearest_bound nearest_risk: where there is none, what comes nearest, its bound, and the
        share of its answers that are above max_error
    nearest_error nearest_s: its mean error, the truth's own added, and the time of its slowest press, or where a body
        moves of a step at the 95th percentile [s]
    speed times_life: seconds of motion in a second, asked for and reached
    bound_on: where a body moves, what the bound was measured on, or that the error is of this path only, and why
    why: the reason
    """,
)


SPREAD = "95th percentile"
"""What stands for a bound where too few touches were asked."""
PATH = "error on this path only"
"""What stands for a bound of a motion that was measured nowhere else."""
_PRESSED = (("limit", EQUAL), ("slowest_s", 1.0)), (("pace", TIED), ("limit", EQUAL), ("mean", EQUAL), ("pace", 1.0))
"""What decides of presses: ties go to what budgets are compared with, so that a larger one never has a larger bound."""
_MOVED = (("own_path", EQUAL), ("pace", TIED_TIMES)), FASTEST
"""What decides of motions: within a time the error of the scene's own, which all settings have."""


def limits_of(
    budgets_ms: Iterable[float] = (), max_errors: Iterable[float] = (), speeds: Iterable[float] = ()
) -> list[Limit]:
    """Return one limit for each time [ms], error and speed."""
    found = [Limit(budget_ms=budget) for budget in budgets_ms] + [Limit(max_error=error) for error in max_errors]
    return found + [Limit(speed=speed) for speed in speeds]


def _rows(asked: Candidates, limits: Iterable[Limit], **told: object) -> Iterable[dict]:
    """Yield what is advised under each limit: columns of ADVICE, and others of the candidates."""
    for limit in limits:
        own = {"reference_error": asked.own, "unit": asked.unit}
        yield {"model": NONE} | asked.advise(limit) | told | limit._asdict() | own


def advise(
    settings: pd.DataFrame,
    errors: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    kinds: Sequence[str] = tuple(KINDS),
) -> pd.DataFrame:
    """Tabulate advice.csv of one pressed scene: a row for each kind, budget [ms] and largest error.

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``ranking.read_errors`` gives them
    Settings are judged at all contacts that they have not learnt from (``HeldOut``), and one that failed on any sample
    is never advised. Raises InputError if the two tables do not belong together.
    """
    _check(settings, errors)
    rows = []
    for kind in kinds:
        asked = presses(settings, errors, kind)
        tests = errors[errors["side"] == "test"]
        for row in _rows(asked, limits_of(budgets_ms, max_errors), scene=settings["scene"].iloc[0], error=kind):
            if row["model"] != NONE:
                mine = tests[(tests["model"] == row["model"]) & (tests["setting"] == row["setting"])]
                row["error_low"], row["error_high"] = resampled(mine, KINDS[kind]).iloc[0].quantile(list(RANGE))
            rows.append(row)
    return ADVICE.frame(rows)


def presses(settings: pd.DataFrame, errors: pd.DataFrame, kind: str) -> Candidates:
    """Return the settings of a pressed scene; the arguments as of ``advise``."""
    held, own = HeldOut(settings, errors, KINDS[kind]), own_error(settings, KINDS[kind])
    rows = held.rows.assign(limit=held.rows["bound_of_peak"], mean=held.rows["mean_of_peak"], basis=BOUND, doubted=0)
    rows = rows.assign(pace=rows["online_median_s"], slowest_s=rows["online_max_s"])
    lost = f"settings left out as they failed on some samples: {held.failed}" if held.failed else ""
    notes = ["" if len(rows) else "no setting has answered every sample", unknown(errors, KINDS[kind]), lost]
    floor = float(np.fmax(EXACT, finite(held.own_bound) + own))
    return Candidates(rows, own, floor, _PRESSED, notes=notes, held=held)


def _check(settings: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Raise InputError if a setting stands twice or its samples do not have the mean that its row gives."""
    place = ["split", *SETTING]
    able = settings[~settings["model"].isin(BOUNDS) & (settings["failures"] == 0)].set_index(place, drop=False)
    scene = settings["scene"].iloc[0]
    if able.index.has_duplicates:
        twice = able[able.index.duplicated()].iloc[0]
        raise InputError(
            f"accuracy_vs_time.csv has {twice['model']} {twice['setting']} of {scene} twice: give each its own setting"
        )
    found = errors[errors["side"] == "test"].groupby(place)["rmse_of_peak"].mean().reindex(able.index)
    if not (right := np.isclose(found, able["rmse_of_peak"], rtol=1e-6, atol=0)).all():
        raise InputError(
            f"accuracy_vs_time.csv and the samples of {' '.join(able[~right].iloc[0][SETTING])} of {scene} disagree: "
            "make both anew with the workflow"
        )


def advise_any_load(
    rows: pd.DataFrame,
    kind: str,
    budget_ms: float | None = None,
    max_error: float | None = None,
    error: str = "rms",
    own: float = np.nan,
) -> pd.Series:
    """Choose from the ``rows`` of any_load.csv of one scene, for one ``kind`` of load: a row like those of ADVICE.

    own : ``operator_error``, which is added to errors that are compared with ``max_error``; NaN where not known
    error : one of KINDS
    What failed without saying so before is never advised, and what says which loads it cannot answer where nothing
    answers all. The bound is the largest error: from FEWEST contacts on, nine in ten others stay below it.
    Raises InputError for a kind that the table does not have, and without a limit.
    """
    scene, column = rows["scene"].iloc[0], KINDS[error]
    answers = rows[rows["kind"] == kind]
    if answers.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    if max_error is None and budget_ms is None:
        raise InputError("advice for a kind of load needs a limit; give --max-error or --budget-ms.")
    able = answers[(answers["refused"] == 0) & (answers["failures"] == 0) & (answers["contacts"] > 0)]
    most = able[f"{column}_most"]
    able = able.assign(
        most=most, mean=able[column], basis=BOUND,
        limit=np.where(able["contacts"] >= FEWEST, most + np.nan_to_num(own), np.inf),
        pace=able["online_median_s"], slowest_s=able["online_max_s"],
    )  # fmt: skip
    refused = sorted(set(answers["model"]) - set(answers.loc[answers["refused"] == 0, "model"]))
    notes = ["" if len(able) else "no setting has answered all loads"]
    notes.append(f"refused by {', '.join(refused)}" if refused else "")
    return _one(Candidates(able, own, unit="load", notes=notes), budget_ms, max_error, scene, load=kind, error=error)


def _one(asked: Candidates, budget_ms: float | None, max_error: float | None, scene: str, **told: object) -> pd.Series:
    limit = Limit(*(np.nan if each is None else each for each in (budget_ms, max_error)))
    [found] = _rows(asked, [limit], scene=scene, **told)
    names = [*ADVICE.columns, "limit", "basis", "samples", "doubted"]
    return pd.Series({name: found.get(name, np.nan) for name in dict.fromkeys([*names, *found])})


def advise_touch(rows: pd.DataFrame, budget_ms: float | None = None, max_error: float | None = None) -> pd.Series:
    """Choose from the ``rows`` of touch.csv about one scene, by the error of the force: a row like those of ADVICE.

    What failed on a touch, or gives no force, is not taken. The limit is the bound, where there is one, else the 95th
    percentile over the touches, in both cases with the truth's own error.
    """
    own = float(rows.loc[rows["model"] == TRUTH, "force_error_p95"].max())
    able = rows[(rows["model"] != TRUTH) & (rows["failures"] == 0) & rows["force_error_size"].notna()]
    bound, p95 = able["force_error_bound"], able["force_error_p95"] + own
    able = able.assign(
        limit=bound.fillna(p95).fillna(np.inf), basis=np.where(bound.notna(), BOUND, SPREAD), doubted=0,
        mean=able["force_error_size"], pace=able["online_median_s"], slowest_s=able["online_max_s"],
    )  # fmt: skip
    able = able[np.isfinite(able["limit"])]
    asked = Candidates(able, own, unit="touch", notes=[] if len(able) else ["no model gives a force"])
    return _one(asked, budget_ms, max_error, rows["scene"].iloc[0], error="force")


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
    """Tabulate advice.csv of a scene that moves, a row for each budget of a step [ms], error [of its peak] and speed.

    motions : its rows of dynamic_accuracy.csv; bounds : its rows of motion_bounds.csv, if there are any
    speeds : seconds of motion that shall be computed in a second, or more
    pressed : accuracy_vs_time.csv, whose presses show how wrong the standard's mesh is
    error : "rms", of the displacement, or "force", of the instruments' force, which then stands in ``rmse_of_peak``
    together : whether the one error and the one speed are both meant, in one row
    A budget is for 95 % of the steps of what runs in real time. What stays below an error is the bound of pushes
    elsewhere, that of ``constant`` in ``bounds``; where a scene has none, the error on its own path, the standard's
    own added. Such a scene has one load, so nothing can be drawn anew: interval and confidence stay empty.
    """
    # modes for another place show what that costs, and nobody who knows the place takes them
    able = motions[(motions["failures"] == 0) & (motions["varied"] != "place")]
    if error == "force":  # how wrong the standard's mesh is in it no press shows, and of pushes elsewhere none is known
        felt = able.dropna(subset="force_rms_of_peak")
        able = felt.assign(rmse_of_peak=felt["force_rms_of_peak"], reference_error=felt["reference_force_error"])
        bounds = pressed = None
    first = motions.iloc[0]
    # such a scene is not divided, and has no patch
    told = {"scene": first["scene"], "error": error, "split": 0, "over": _over(first)}
    limits = limits_of(budgets_ms, max_errors, speeds)
    if together:
        limits = [Limit(max_error=max_errors[0], speed=speeds[0])]
    return ADVICE.frame(_rows(_moving(able, first, bounds, pressed, error), limits, **told))


def _moving(
    able: pd.DataFrame, first: pd.Series, bounds: pd.DataFrame | None, pressed: pd.DataFrame | None, error: str
) -> Candidates:
    """Return the settings of a scene that moves; the arguments as of ``advise_motion``, ``able`` : what got through."""
    if said := parted(first):
        able, notes = able[:0], [f"no error of a model is known, as {said}"]
    elif able.empty:
        notes = [f"no model got through the scene{' and told a force' if error == 'force' else ''}"]
    else:
        own = _own(able, pressed)
        notes = [f"errors are from the standard, {_standard(able.iloc[0], own, error)}"]
    if able.empty:
        return Candidates(able, order=_MOVED, notes=notes)
    bound, measured_on = zip(*(bound_elsewhere(row, bounds) for _, row in able.iterrows()), strict=True)
    measured = bool(np.isfinite(bound).any())
    limit = pd.Series(bound, able.index) if measured else able["rmse_of_peak"] + own
    if np.isnan(own):
        limit[:] = np.inf
    able = able.assign(
        own_path=able["rmse_of_peak"], mean=np.nansum([able["rmse_of_peak"], np.full(len(able), own)], axis=0),
        limit=limit.fillna(np.inf), basis=BOUND if measured else PATH, bound_on=measured_on,
        pace=able["real_time_factor"], slowest_s=1e-3 * able["step_p95_ms"], doubted=0,
        online_p95_s=1e-3 * able["step_p95_ms"], online_max_s=1e-3 * able["step_max_ms"],
        times_life=1.0 / able["real_time_factor"],
    )  # fmt: skip
    return Candidates(able, own, order=_MOVED, unit="step", moves=True, notes=notes)


def bound_elsewhere(best: pd.Series, bounds: pd.DataFrame | None) -> tuple[float, str]:
    """Return the bound of a setting's error where the push is elsewhere, and what it was measured on, in words.

    Without a bound, NaN and the reason.
    """
    alone = "on this path only, as"
    if bounds is None or bounds.empty:
        return np.nan, f"{alone} nothing was measured elsewhere"
    places = int(bounds["places"].max())
    constant = bounds[bounds["estimate"] == CONSTANT].set_index(["model", "setting"])
    key = best["model"], best["setting"]
    if key not in constant.index:
        return np.nan, f"{alone} this setting was not asked at the {places} other places"
    row = constant.loc[key]
    if np.isnan(row["bound_of_peak"]):
        return np.nan, f"{alone} this setting answered at {row['places'] - row['failures']:g} of {places} other places"
    kept = f", where it held for {percent(row['coverage'])} of the places held out" * bool(np.isfinite(row["coverage"]))
    return float(row["bound_of_peak"]), f"{places} other places of the push{kept}"


def _standard(first: pd.Series, own: float, error: str) -> str:
    """Say how wrong the standard of a motion is; first : a row of dynamic_accuracy.csv."""
    if first["reference"] == QUADRATIC:
        return f"the limit of quadratic elements, which is {percent(own)} wrong itself"
    mesh = f"mesh (level {first['reference_level']:g})"
    if np.isnan(own):
        why = "" if error == "force" else ", as no other mesh was tried, and no press of this body measured"
        return f"whose own error is not known{why} on its {mesh}"
    if np.isfinite(first.get("reference_error", np.nan)):
        return f"which is {percent(own)} wrong itself, as another mesh and shorter steps say"
    return f"which is {percent(own)} wrong itself, by its {mesh} and its step"


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


QUADRATIC = "fem_p2"
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
    if first["reference"] == QUADRATIC or np.isfinite(first.get("reference_error", np.nan)):
        return float(first["reference_error"])
    mesh = mesh_error(pressed, first["body"], int(first["reference_level"]))
    return np.nan if mesh is None else float(mesh.high + first["reference_change"])


def operator_error(pressed: pd.DataFrame, column: str) -> float:
    """Return how wrong the fine operator is, of the peak: its distance from the truth, and the truth's own error.

    pressed : the scene's rows of accuracy_vs_time.csv; column : one of KINDS
    The mean over test samples of the most exact setting of QUADRATIC on its finest level that was measured; NaN where
    there is none, or no truth.
    """
    rows = pressed[(pressed["model"] == QUADRATIC) & (pressed["failures"] == 0)]
    told = fields_of(rows, "level", "start", "tolerance", "target")
    told = told[(told["start"] == "rest") & told["target"].isna()][["level", "tolerance"]].dropna()
    told = told.sort_values(["level", "tolerance"], ascending=[False, True])
    if told.empty:
        return np.nan
    finest = told.index[(told == told.iloc[0]).all(axis=1)]
    return float(rows.loc[finest, column].mean()) + own_error(pressed, column)
