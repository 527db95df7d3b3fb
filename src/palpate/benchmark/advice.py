"""Tell from tables of measurements which model to take: for presses, loads of other kinds, touches and motions."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.choosing import BOUND, NONE, SETTING, TIED, Candidates, HeldOut, Limit
from palpate.benchmark.conformal import CONSTANT, FEWEST, bound_factor, finite
from palpate.benchmark.ranking import (
    BOUNDS,
    EXACT,
    KINDS,
    RANGE,
    SIDES,
    TRAINING,
    TRUTH,
    averaged,
    fields_of,
    own_error,
    own_errors,
    resampled,
    same_settings,
    unknown,
)
from palpate.errors import InputError
from palpate.number_text import percent_in_table as percent
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
QUADRATIC = "fem_p2"
"""What dynamic_accuracy.csv calls a reference that is a truth: the limit of these elements."""
ELEMENTS = "fem_p1"
"""The elements of the standard that motions are compared with, among the models of accuracy_vs_time.csv."""
_FIRST = {side: i for i, side in enumerate((*SIDES[::-1], TRAINING))}


def choice(candidates: Candidates, limit: Limit) -> pd.Series:
    """Return what is advised under one limit: the columns of ADVICE, and those of the table that it follows from."""
    return pd.Series(dict.fromkeys(ADVICE.columns, np.nan) | candidates.advise(limit))


def limits_of(
    budgets_ms: Iterable[float] = (), max_errors: Iterable[float] = (), speeds: Iterable[float] = ()
) -> list[Limit]:
    """Return one limit for each time [ms], error and speed."""
    limits = [Limit(budget_ms=budget) for budget in budgets_ms] + [Limit(max_error=error) for error in max_errors]
    return limits + [Limit(speed=speed) for speed in speeds]


def advise(
    settings: pd.DataFrame,
    errors: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    kinds: Sequence[str] = tuple(KINDS),
) -> pd.DataFrame:
    """Tabulate advice.csv of one pressed scene: a row for each kind of error, budget [ms] and largest error.

    The arguments as of ``presses``. Raises InputError if the two tables do not belong together.
    """
    _check(settings, errors)
    rows, tests = [], errors[errors["side"] == "test"]
    for kind in kinds:
        candidates = presses(settings, errors, kind)
        for row in map(candidates.advise, limits_of(budgets_ms, max_errors)):
            if row["model"] != NONE:
                of_advised = tests[(tests["model"] == row["model"]) & (tests["setting"] == row["setting"])]
                row["error_low"], row["error_high"] = resampled(of_advised, KINDS[kind]).iloc[0].quantile(list(RANGE))
            rows.append(row)
    return ADVICE.frame(rows)


def presses(settings: pd.DataFrame, errors: pd.DataFrame, kind: str) -> Candidates:
    """Return the settings of a pressed scene that answered all samples that they were asked.

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``ranking.read_errors`` gives them
    kind : one of KINDS
    They are judged at all contacts that they have not learnt from. The truth's own error is added to each error:
    distances obey the triangle inequality, so the sum bounds the distance from the exact answer. A root of squares
    would take the two as independent, and models that extrapolate from the levels of the truth err as it does.
    """
    column = KINDS[kind]
    errors_of, means = _wide(settings, errors, column), averaged(settings)
    contact, sample = (errors_of.columns.get_level_values(name).to_numpy() for name in ("contact", "sample"))
    own_of_samples = np.nan_to_num(own_errors(errors, column, sample))
    means = means[~means["model"].isin(BOUNDS)].set_index(SETTING, drop=False)
    rows = means[means.index.isin(errors_of.index)]
    held_out = HeldOut(errors_of.reindex(rows.index).to_numpy() + own_of_samples, contact)
    asked = np.isfinite(held_out.errors)
    rows = rows.reset_index(drop=True)
    rows = rows.assign(
        limit=held_out.bound, mean=held_out.mean, basis=BOUND, doubted=0, presses=asked.sum(axis=1),
        contacts=[len(np.unique(contact[answered])) for answered in asked],
        pace=rows["online_median_s"], slowest_s=rows["online_max_s"],
    )  # fmt: skip
    failed = len(means) - len(rows)
    notes = [
        "" if len(rows) else "no setting has answered every sample",
        unknown(errors, column),
        f"settings left out as they failed on some samples: {failed}" if failed else "",
    ]
    own_mean = own_error(settings, column)
    floor = float(np.fmax(EXACT, finite(bound_factor(own_of_samples, contact)) + own_mean))
    labels = {"scene": settings["scene"].iloc[0], "error": kind}
    return Candidates(rows, labels, "press", own_mean, floor, tied=TIED, notes=notes, held=held_out)


def _wide(settings: pd.DataFrame, errors: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return a row for each setting without failures, as ``averaged`` names it, and a column (contact, sample) each.

    The error at a contact is that of the split that tests on it, else of the one that chooses settings by it; settings
    that learn nothing may have answers at training contacts, too.
    """
    keys = ["split", *SETTING]
    named = settings[keys].assign(key=same_settings(settings))
    named = named.assign(first=named.groupby(["model", "key"], sort=False)["setting"].transform("first"))
    joined = errors.merge(named, on=keys).sort_values("side", key=lambda sides: sides.map(_FIRST), kind="stable")
    joined["setting"] = joined["first"]
    has_failed = joined[column].isna().groupby([joined[name] for name in SETTING]).any()
    table = joined.drop_duplicates([*SETTING, "sample"]).pivot(
        index=SETTING, columns=["contact", "sample"], values=column
    )
    return table.loc[table.index.isin(has_failed.index[~has_failed])]


def _check(settings: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Raise InputError if a setting stands twice or its samples do not have the mean that its row gives."""
    keys = ["split", *SETTING]
    usable = settings[~settings["model"].isin(BOUNDS) & (settings["failures"] == 0)].set_index(keys, drop=False)
    scene = settings["scene"].iloc[0]
    if usable.index.has_duplicates:
        twice = usable[usable.index.duplicated()].iloc[0]
        raise InputError(
            f"accuracy_vs_time.csv has {twice['model']} {twice['setting']} of {scene} twice: give each its own setting"
        )
    means = errors[errors["side"] == "test"].groupby(keys)["rmse_of_peak"].mean().reindex(usable.index)
    if not (right := np.isclose(means, usable["rmse_of_peak"], rtol=1e-6, atol=0)).all():
        raise InputError(
            f"accuracy_vs_time.csv and the samples of {' '.join(usable[~right].iloc[0][SETTING])} of {scene} disagree: "
            "make both anew with the workflow"
        )


def other_loads(rows: pd.DataFrame, kind: str, error: str = "rms", own: float = np.nan) -> Candidates:
    """Return the settings that answered loads of one ``kind`` of one scene, which nothing was prepared for.

    rows : of any_load.csv, about that scene; error : one of KINDS
    own : ``operator_error``, which is added to errors that are compared with a largest one; NaN where not known
    Settings that failed on a load are left out, and those that refused the kind; those that doubted answers come after
    those that did not. The bound is the largest error: from FEWEST contacts on, nine in ten others stay below it.
    Raises InputError for a kind that the table does not have.
    """
    scene, column = rows["scene"].iloc[0], KINDS[error]
    answers = rows[rows["kind"] == kind]
    if answers.empty:
        raise InputError(f"any_load.csv has no loads of the kind {kind} in {scene}; choose another scene.")
    answering = answers[(answers["refused"] == 0) & (answers["failures"] == 0) & (answers["contacts"] > 0)]
    largest = answering[f"{column}_most"]
    answering = answering.assign(
        most=largest, mean=answering[column], basis=BOUND,
        limit=np.where(answering["contacts"] >= FEWEST, largest + np.nan_to_num(own), np.inf),
        pace=answering["online_median_s"], slowest_s=answering["online_max_s"],
    )  # fmt: skip
    refused = sorted(set(answers["model"]) - set(answers.loc[answers["refused"] == 0, "model"]))
    notes = [
        "" if len(answering) else "no setting has answered all loads",
        f"refused by {', '.join(refused)}" if refused else "",
    ]
    about = {"scene": scene, "load": kind, "error": error}
    return Candidates(answering.reset_index(drop=True), about, "load", own, notes=notes)


def touches(rows: pd.DataFrame) -> Candidates:
    """Return the settings that found the force of every touch of one scene; rows : of touch.csv, about that scene.

    The limit is the bound, where there is one, else the 95th percentile over the touches, in both cases with the
    truth's own error.
    """
    own_p95 = float(rows.loc[rows["model"] == TRUTH, "force_error_p95"].max())
    answering = rows[(rows["model"] != TRUTH) & (rows["failures"] == 0) & rows["force_error_size"].notna()]
    bound, p95 = answering["force_error_bound"], answering["force_error_p95"] + own_p95
    answering = answering.assign(
        limit=bound.fillna(p95), basis=np.where(bound.notna(), BOUND, SPREAD), doubted=0,
        mean=answering["force_error_size"], pace=answering["online_median_s"], slowest_s=answering["online_max_s"],
    )  # fmt: skip
    answering = answering[np.isfinite(answering["limit"])].reset_index(drop=True)
    about = {"scene": rows["scene"].iloc[0], "error": "force"}
    return Candidates(answering, about, "touch", own_p95, notes=[] if len(answering) else ["no model gives a force"])


def advise_motion(
    rows: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    speeds: Sequence[float] = (),
    bounds: pd.DataFrame | None = None,
    pressed: pd.DataFrame | None = None,
    error: str = "rms",
) -> pd.DataFrame:
    """Tabulate advice.csv of a scene that moves, a row for each budget of a step [ms], error [of its peak] and speed.

    rows, bounds, pressed, error : of ``motions``
    """
    candidates = motions(rows, bounds, pressed, error)
    return ADVICE.frame(map(candidates.advise, limits_of(budgets_ms, max_errors, speeds)))


def motions(
    rows: pd.DataFrame,
    bounds: pd.DataFrame | None = None,
    pressed: pd.DataFrame | None = None,
    error: str = "rms",
) -> Candidates:
    """Return the settings that got through a scene that moves.

    rows : its rows of dynamic_accuracy.csv; bounds : its rows of motion_bounds.csv, if there are any
    pressed : accuracy_vs_time.csv, whose presses show how wrong the standard's mesh is
    error : "rms", of the displacement, or "force", of the instruments' force, which then stands in ``rmse_of_peak``
    A budget limits the time that 95 % of the steps take, of settings in real time. A largest error limits the bound
    ``constant`` of ``bounds``, found with the push elsewhere or, where a scene has none, the error on its own path with
    the standard's own added. Within a time the error on its own path decides, as all settings have it.
    """
    first_row = rows.iloc[0]
    resolved_s, whole_s = first_row["resolved_s"], first_row["duration_s"]
    over = f"the first {resolved_s:.3g} of {whole_s:.3g} s" if resolved_s < whole_s * (1 - 1e-9) else "the whole motion"
    about = {"scene": first_row["scene"], "error": error, "split": 0, "over": over}  # such a scene is not divided
    # modes for another place show what that costs, and nobody who knows the place takes them
    finished = rows[(rows["failures"] == 0) & (rows["varied"] != "place")].reset_index(drop=True)
    if error == "force":  # how wrong the standard's mesh is in it no press shows, and of pushes elsewhere none is known
        finished = finished.dropna(subset="force_rms_of_peak").reset_index(drop=True)
        finished = finished.assign(
            rmse_of_peak=finished["force_rms_of_peak"], reference_error=finished["reference_force_error"]
        )
        bounds = pressed = None
    if reason := parted(first_row):
        return Candidates(finished[:0], about, "step", notes=[f"no error of a model is known, as {reason}"])
    if finished.empty:
        felt = " and told a force" if error == "force" else ""
        return Candidates(finished, about, "step", notes=[f"no model got through the scene{felt}"])
    own, reference = _reference(finished.iloc[0], pressed, error)
    bound, measured_on = zip(*(bound_elsewhere(row, bounds) for _, row in finished.iterrows()), strict=True)
    measured = bool(np.isfinite(bound).any())
    limit = pd.Series(bound) if measured else finished["rmse_of_peak"] + own
    finished = finished.assign(
        mean=finished["rmse_of_peak"] + np.nan_to_num(own), limit=np.inf if np.isnan(own) else limit.fillna(np.inf),
        basis=BOUND if measured else PATH, bound_on=measured_on, doubted=0,
        pace=finished["real_time_factor"], times_life=1.0 / finished["real_time_factor"],
        slowest_s=1e-3 * finished["step_p95_ms"], online_p95_s=1e-3 * finished["step_p95_ms"],
        online_max_s=1e-3 * finished["step_max_ms"],
    )  # fmt: skip
    notes = [f"errors are from the standard, {reference}"]
    return Candidates(finished, about, "step", own, compared="rmse_of_peak", notes=notes)


def parted(first: pd.Series) -> str:
    """Return why no error of a model is known in a scene, or nothing; first : a row of dynamic_accuracy.csv."""
    said = first["parted"]
    return said if isinstance(said, str) else ""


def bound_elsewhere(row: pd.Series, bounds: pd.DataFrame | None) -> tuple[float, str]:
    """Return the bound of a setting's error where the push is elsewhere, and what it was measured on, in words.

    row : of dynamic_accuracy.csv; bounds : of motion_bounds.csv. Without a bound, NaN and the reason.
    """
    on_path = "on this path only, as"
    if bounds is None or bounds.empty:
        return np.nan, f"{on_path} nothing was measured elsewhere"
    places = f"{bounds['places'].max():g} other places"
    is_setting = (bounds["model"] == row["model"]) & (bounds["setting"] == row["setting"])
    rows = bounds[is_setting & (bounds["estimate"] == CONSTANT)]
    if rows.empty:
        return np.nan, f"{on_path} this setting was not asked at the {places}"
    bound_row = rows.iloc[0]
    if np.isnan(bound_row["bound_of_peak"]):
        return np.nan, f"{on_path} this setting answered at {bound_row['places'] - bound_row['failures']:g} of {places}"
    was_tried = np.isfinite(bound_row["coverage"])
    coverage = f", where it held for {percent(bound_row['coverage'])} of the places held out" if was_tried else ""
    return float(bound_row["bound_of_peak"]), f"{places} of the push{coverage}"


def _reference(row: pd.Series, pressed: pd.DataFrame | None, error: str) -> tuple[float, str]:
    """Return the own error of what motions are compared with (NaN: not known), and say it in words.

    row : of dynamic_accuracy.csv
    A truth has its own; the standard's is what other meshes say or, if none were tried, that of its mesh, the largest
    over presses, and of its step.
    """
    own, mesh = float(row["reference_error"]), f"mesh (level {row['reference_level']:g})"
    if row["reference"] == QUADRATIC:
        return own, f"the limit of quadratic elements, which is {percent(own)} wrong itself"
    if np.isfinite(own):
        return own, f"which is {percent(own)} wrong itself, as another mesh and shorter steps say"
    of_mesh = mesh_error(pressed, row["body"], int(row["reference_level"]))
    if of_mesh is None:
        why = "" if error == "force" else ", as no other mesh was tried, and no press of this body measured"
        return np.nan, f"whose own error is not known{why} on its {mesh}"
    own = float(of_mesh.high + row["reference_change"])
    return own, f"which is {percent(own)} wrong itself, by its {mesh} and its step"


class MeshError(NamedTuple):
    """Least and largest mean error of a level over the regimes of a body, of the peak: everywhere, at the patch."""

    low: float
    high: float
    patch_low: float
    patch_high: float


def mesh_error(pressed: pd.DataFrame | None, body: str, level: int) -> MeshError | None:
    """Return the error of converged linear elements of a level against the truth of presses, None if it is not known.

    pressed : accuracy_vs_time.csv, None if there is none
    """
    if pressed is None:
        return None
    rows = _converged(pressed[pressed["body"] == body], ELEMENTS, level)
    if rows.empty:
        return None
    means = rows.groupby("scene")[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    surface, patch = means["rmse_of_peak"], means["patch_rms_of_peak"]
    return MeshError(surface.min(), surface.max(), patch.min(), patch.max())


def operator_error(pressed: pd.DataFrame, column: str) -> float:
    """Return how wrong the fine operator is, of the peak: its distance from the truth, and the truth's own error.

    pressed : the scene's rows of accuracy_vs_time.csv; column : one of the columns of KINDS
    The mean over test samples of QUADRATIC on its finest level; NaN where there is none, or no truth.
    """
    rows = _converged(pressed[pressed["failures"] == 0], QUADRATIC)
    return float(rows[column].mean()) + own_error(pressed, column)


def _converged(pressed: pd.DataFrame, elements: str, level: int | None = None) -> pd.DataFrame:
    """Select the rows of elements on a level, the finest if none is named, that were solved most exactly from rest."""
    rows = pressed[pressed["model"] == elements]
    fields = fields_of(rows, "level", "start", "tolerance", "target")
    fields = fields[(fields["start"] == "rest") & fields["target"].isna() & fields["tolerance"].notna()]
    fields = fields[fields["level"] == (fields["level"].max() if level is None else level)]
    return rows.loc[fields.index[fields["tolerance"] == fields["tolerance"].min()]]
