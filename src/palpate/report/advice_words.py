"""Put advice into words, once: lines for the terminal, cells for the tables of the report."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.benchmark.advice import NONE, name
from palpate.benchmark.advice_other_loads import doubts
from palpate.benchmark.comparable import STROKED
from palpate.benchmark.conformal import FEWEST
from palpate.benchmark.ranking import EQUAL, KINDS, TIED_TIMES, UNKNOWN
from palpate.report.model_looks import label
from palpate.report.words import percent, seconds, two_digits

WHERE = {
    "rms": "of the peak displacement",
    "patch": "of the peak displacement at the patch",
    "force": "of the peak force",
}
"""The meaning of each kind of error."""
SAME = "the same"
"""A cell of a table of advice like that on its left."""


def lines(advice: pd.Series, rows: pd.DataFrame | None = None) -> str:
    """Return lines for the terminal about one row of advice.csv.

    rows : of a scene that moves its rows of dynamic_accuracy.csv
    """
    head = f"{advice['scene']}, {limit(advice)}"
    if advice["model"] == NONE:
        return _lines(f"{head}: none", nearest=nearest(advice), because=advice["why"])
    p95 = f"{seconds(advice['online_p95_s'])} at the 95th percentile, {seconds(advice['online_max_s'])} for the slowest"
    here = "on the machine that filled the tables"
    if rows is not None:
        row = rows[(rows["model"] == advice["model"]) & (rows["setting"] == advice["setting"])].iloc[0]
        before = _prepared(row["offline_s"])
        doubted, told = advice["model"] in STROKED, row["estimate_of_peak"]
        meaning = "grows with its error and is not its size" if doubted else "the model finds without the standard"
        found = {
            "error": moved_error(advice, row),
            "doubt" if doubted else "estimate": f"{percent(told)} of the displacement, which {meaning}"
            if np.isfinite(told)
            else "",
            "bound": bounded(advice),
            "speed": f"{pace(advice['times_life'])}, {seconds(1e-3 * row['ms_per_step'])} a step, {p95}, {here}",
        }
    else:
        other = f"at the patch {percent(advice['patch_rms_of_peak'])}"
        if advice["error"] == "patch":
            other = f"over the whole surface {percent(advice['rmse_of_peak'])}"
        found = {
            "error": f"{percent(error_of(advice))} {WHERE[advice['error']]} on average "
            f"({interval(advice)} in 90 % of draws of the test contacts); {other}",
            "bound": bounded(advice),
            "rejected": answered_without_truth(advice),
            "time": f"{seconds(advice['online_median_s'])} an answer (median), {p95} press, {here}",
        }
        before = f"{_prepared(advice['offline_s'])}, {advice['memory_mb']:.3g} MB"
    rest = {"margin": _margin(advice), "before": before, "because": advice["why"]}
    return _lines(f"{head}: {name(advice)}", beware=exceeded(advice), **found, **rest)


def _margin(advice: pd.Series) -> str:
    """Return what is left of what was asked for; a motion within a budget also has to run in real time."""
    left = {f"the allowed {'time' if timed(advice) else 'error'}": advice["margin"]}
    if moves(advice) and np.isfinite(advice["budget_ms"]):
        step = 1.0 - 1e3 * advice["online_p95_s"] / advice["budget_ms"]
        left = {"real time": 1.0 - 1.0 / advice["times_life"], "the time allowed for a step": step}
    said = [f"{percent(share) if share > 0 else 'nothing'} of {what}" for what, share in left.items()]
    return f"{' and '.join(said)} {'are' if len(said) > 1 else 'is'} left"


def _prepared(offline_s: float) -> str:
    return f"{seconds(offline_s)} of preparation" if offline_s > 0 else "nothing to prepare"


def any_load_lines(advice: pd.Series) -> str:
    """Return lines for the terminal about a kind of load."""
    head = f"{advice.scene}, {advice.kind}"
    if advice.model == NONE:
        return _lines(f"{head}: none", nearest=_nearest_any(advice), because=advice.why)
    share = percent(advice.doubted / advice.samples)
    count = f"{advice.doubted} of {advice.samples} loads ({share})"
    return _lines(
        f"{head}: {name(advice)}",
        error=_error_any(advice),
        bound=f"{'of those that it answers, ' if advice.doubted else ''}{_bound_any(advice)}",
        doubts=f"{count}: it says that it does not know, and gives no answer" if advice.doubted else "",
        time=f"{seconds(advice.online_p95_s)} at the 95th percentile, {seconds(advice.online_max_s)} for the slowest "
        "load, on the machine that filled the tables",
        before=f"{seconds(advice.offline_s)} of preparation"
        + (f", {seconds(advice.preparation_s)} for a new press" if advice.preparation_s > 0 else ""),
        because=advice.why,
    )


def force_lines(advice: dict) -> str:
    """Return lines for the terminal about what ``benchmark.touch_advice`` advises in a scene."""
    asked = "whatever time it takes"
    if advice["max_error"] is not None:
        asked = f"error of the force of at most {percent(advice['max_error'])}"
    elif advice["budget_ms"] is not None:
        asked = f"within {advice['budget_ms']:g} ms"
    head, own = f"{advice['scene']}, {asked}", advice["own"]
    if advice["model"] == NONE:
        near = advice["nearest"]
        told = (
            f"{label(near['model'], near['setting'])}: {_force_error(near, own)}; {_force_time(near)}" if near else ""
        )
        return _lines(f"{head}: none", nearest=told, because=advice["why"])
    return _lines(
        f"{head}: {label(advice['model'], advice['setting'])}",
        error=_force_error(advice, own),
        surface=f"{percent(advice['rmse_of_peak'])} {WHERE['rms']} on average, in the dent "
        f"{percent(advice['patch_rms_of_peak'])}",
        time=f"{_force_time(advice)}, on the machine that filled the tables",
        before=f"{_prepared(advice['offline_s'])}"
        + (f", {seconds(advice['preparation_s'])} for a new place" if advice["preparation_s"] > 1e-4 else "")
        + f", {advice['memory_mb']:.3g} MB",
        because=advice["why"],
    )


def _force_error(told: dict, own: float) -> str:
    """Return the mean error of the force, with its sign where all have the same, and below what nine in ten stay."""
    few = f"{told['samples']:.0f} touches"
    what = f"nine answers in ten at other places are below {percent(told['limit'])}, by {few}"
    if not told["bounded"]:
        what = f"{percent(told['limit'])} at the 95th percentile of {few}, which are too few for a bound ({FEWEST})"
    size, mean = told["force_error_size"], told["force_error"]
    way = f"by {percent(abs(mean))} too {'large' if mean > 0 else 'small'} with its sign"
    return f"{percent(size)} of the force on average, {way}; {what}, the truth's own {percent(own)} in it"


def _force_time(told: dict) -> str:
    return (
        f"{seconds(told['online_median_s'])} an answer (median), {seconds(told['online_max_s'])} for the slowest touch"
    )


def _error_any(advice: pd.Series) -> str:
    """Return the error of a model that a kind of load is about, and that of the fine operator it was compared with."""
    own = advice.own_of_peak
    known = f"which is {percent(own)} wrong itself, so {percent(advice.error_of_peak + own)} with it"
    force = f"; of the force {percent(advice.force_error)}" if np.isfinite(advice.force_error) else ""
    return (
        f"{percent(advice.error_of_peak)} of the peak displacement on average, {percent(advice.most)} at most, from "
        f"the fine operator, {known if np.isfinite(own) else 'whose own error is not known'}{force}"
    )


def _bound_any(advice: pd.Series) -> str:
    few = f"{advice.contacts:.0f} {'contact' if advice.contacts == 1 else 'contacts'}"
    if not np.isfinite(advice.bound_of_peak):
        return f"none, as the answers are at {few} only, and {FEWEST} are needed"
    return f"nine answers in ten at other contacts are wrong by less than {percent(advice.bound_of_peak)}, by {few}"


def _nearest_any(advice: pd.Series) -> str:
    """Return what comes nearest to a limit that nothing keeps for a kind of load; empty where nothing does."""
    if not advice.nearest:
        return ""
    doubted = f"; it {doubts(advice)}" if advice.doubted else ""
    told = f"{_error_any(advice)}; bound: {_bound_any(advice)}; {seconds(advice.online_max_s)} for the slowest load"
    return f"{label(advice.nearest, advice.nearest_setting)}: {told}{doubted}"


def _lines(head: str, **said: str) -> str:
    """Return the head and, indented, what is said of each; what is empty is left out."""
    rows = [head, *(f"  {key:<8}  {text}" for key, text in said.items() if text)]
    return "\n".join(rows).replace("\u00a0", " ")


def advice_list(advice: pd.DataFrame, kind: str = "rms") -> str:
    """Return advice.csv as lines: each scene, and under it what to take for each limit, and what it costs.

    kind : of the errors
    """
    advice = advice[advice["error"] == kind]
    width = max(len(limit(row)) for _, row in advice.iterrows())
    found = []
    for scene, rows in advice.groupby("scene", sort=False):
        found.append(f"Advice for {scene} (mean error as a share {WHERE[kind]}):")
        found += [f"  {limit(row):{width}}  {_choice(row)}" for _, row in rows.iterrows()]
        own = rows["reference_error"].max()
        if rows[["times_life", "speed"]].notna().any(axis=None):
            found.append(f"  Errors are over {rows['over'].iloc[0]}, from a standard {_wrong_itself(own)}.")
        elif np.isnan(own):
            found.append(f"  Beware: {UNKNOWN}.")
        elif own > rows[[KINDS[kind], "max_error"]].min(axis=None):
            found.append(f"  The truth is known to {percent(own)}: below that, models are tied.")
    return "\n".join(found).replace("\u00a0", " ")


def _choice(row: pd.Series) -> str:
    if row["model"] == NONE:
        # of a time the reason is that of what comes nearest
        return f"none: {row['why']}" if timed(row) or pd.isna(row["nearest"]) else f"none; nearest {nearest(row)}"
    said = moved_cell(row) if moves(row) else f"{label(row['model'], row['setting'])}: {cell(row)}"
    return f"{said} (beware: {more})" if (more := exceeded(row)) else said


def cell(advice: pd.Series) -> str:
    """Return error, bound, contacts, times, preparation and memory of a pressed scene's advice, in words."""
    bound = f"nine in ten below {percent(advice['bound_of_peak'])}, " if advice["bound_of_peak"] > 0 else ""
    rests = f"{bound}{advice['contacts']:.0f} contacts, {advice['presses']:.0f} presses"
    time = f"{seconds(advice['online_median_s'])} (slowest press {seconds(advice['online_max_s'])})"
    lost = answered_without_truth(advice)
    return f"{percent(error_of(advice))} ({rests}) in {time}; {spent(advice)}{f'; {lost}' if lost else ''}"


def answered_without_truth(advice: pd.Series) -> str:
    """Say how many of the presses whose truth was rejected a setting answered; nothing where none was."""
    answered, rejected = advice["rejected_answered"], advice["rejected"]
    return f"{answered:.0f} of {rejected:.0f} presses without a truth answered without a doubt" if rejected > 0 else ""


def spent(advice: pd.Series) -> str:
    """Return what the model of a pressed scene's advice takes beforehand."""
    return f"prepared in {seconds(advice['offline_s'])}, {advice['memory_mb']:.3g}\u00a0MB"


def nearest_cell(advice: pd.Series) -> str:
    """Return what comes nearest and its bound, or mean error where it has none, for a cell of a table."""
    if pd.isna(advice["nearest"]):
        return ""
    bound, mean = advice["nearest_bound"], f"{percent(advice['nearest_error'])} on average"
    told = f"nine in ten below {percent(bound)}" if np.isfinite(bound) else mean
    return f"{label(advice['nearest'], 'default')}, {told}"


def nearest(advice: pd.Series) -> str:
    """Return what comes nearest to an error that nothing keeps, and what it risks; empty where nothing does."""
    if pd.isna(advice["nearest"]):
        return ""
    who, error = label(advice["nearest"], advice["nearest_setting"]), percent(advice["nearest_error"])
    time, few = seconds(advice["nearest_s"]), f"{advice['contacts']:.0f} contacts"
    if np.isnan(advice["contacts"]):  # a scene that moves
        known = np.isfinite(advice["nearest_bound"])
        own = "with the standard's own error" if known else "from a standard whose own error is not known"
        return f"{who}: {error} {own}, in {time} a step at the 95th percentile"
    said = f"{who}: nine answers in ten are below {percent(advice['nearest_bound'])} ({few})"
    if not np.isfinite(advice["nearest_bound"]):
        added = ", the truth's own error added" * bool(np.isfinite(advice["reference_error"]))
        said = f"{who}: {error} on average{added} ({few}, {advice['presses']:.0f} presses: too few for a bound)"
    said += f", in {time} for the slowest press"
    if not np.isfinite(advice["nearest_risk"]):
        return said
    return f"{said}; {percent(advice['nearest_risk'])} of its answers are above {percent(advice['max_error'])}"


def moved_cell(advice: pd.Series) -> str:
    """Return model, error, its bound and its speed, within a budget its steps, too, of a scene that moves."""
    if advice["model"] == NONE:
        return "none"
    bound = f", elsewhere below {percent(advice['bound_of_peak'])}" if np.isfinite(advice["bound_of_peak"]) else ""
    error, step = percent(advice["rmse_of_peak"]), ""
    if np.isfinite(advice["budget_ms"]):
        p95, slowest = (seconds(advice[name]) for name in ("online_p95_s", "online_max_s"))
        step = f", a step {p95} (p95), {slowest} at most"
    return f"{label(advice['model'], advice['setting'])}: {error}{bound}, {pace(advice['times_life'])}{step}"


def any_load_cell(advice: pd.Series) -> str:
    """Return model, mean error, bound or what stands for it, and time for a kind of load, for a cell of a table."""
    none, who = advice.model == NONE, (advice.model, advice.setting)
    if none and not advice.nearest:
        return "none"
    if none:
        who = (advice.nearest, advice.nearest_setting)
    few = f"{advice.contacts:.0f} contacts"
    bound = f"at most {percent(advice.most)} ({few}: too few for a bound)"
    if np.isfinite(advice.bound_of_peak):
        bound = f"nine in ten below {percent(advice.bound_of_peak)} ({few})"
    error = f"{percent(advice.error_of_peak)}, {bound}"
    said = f"{'none; nearest ' * none}{label(*who)}: {error}, in {seconds(advice.online_max_s)}"
    return f"{said}, {doubts(advice)}" if advice.doubted else said


def by_limit(advice: pd.DataFrame, names: dict[str, str], cell: Callable[[pd.Series], str]) -> pd.DataFrame:
    """Tabulate advice: a row for each scene of ``names``, a column for each limit, cells as ``cell`` puts them.

    A cell that repeats the one on its left is SAME.
    """
    if advice.empty:
        return pd.DataFrame()
    limits = pd.Series([limit(row) for _, row in advice.iterrows()], index=advice.index, dtype=object)
    wide = advice.assign(taken=[cell(row) for _, row in advice.iterrows()], limit=limits)
    wide = wide.pivot(index="scene", columns="limit", values="taken").reindex(columns=pd.unique(limits))
    wide = wide.mask(wide.eq(wide.shift(axis=1)) & wide.ne("none"), SAME)
    return wide.reindex(index=list(names)).rename(index=names).reset_index()


def limit(advice: pd.Series) -> str:
    """Return what was asked for: "within 16.7 ms", "error of at most 1 %", "20 × real time" or the last two."""
    asked = []
    if np.isfinite(advice.get("speed", np.nan)):  # what is tabulated of presses alone has no speed
        asked.append(f"{advice['speed']:g} × real time")
    if np.isfinite(advice["budget_ms"]):
        asked.append(f"within {advice['budget_ms']:g}\u00a0ms")
    if np.isfinite(advice["max_error"]):
        asked.append(f"error of at most {100 * advice['max_error']:.2g}\u00a0%")
    return ", ".join(asked)


def timed(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a time or a speed, and not about an error."""
    return bool(np.isnan(advice["max_error"]))


def moves(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a scene that moves."""
    return bool(np.isfinite(advice["times_life"]))


def error_of(advice: pd.Series) -> float:
    """Return the error on test contacts of the kind that a row of advice.csv is about."""
    return float(advice[KINDS[advice["error"]]])


def moved_error(advice: pd.Series, row: pd.Series) -> str:
    """Return the error of a motion in words, of the scene's own push; row : of dynamic_accuracy.csv."""
    both = advice["rmse_of_peak"] + advice["reference_error"]
    own = _wrong_itself(advice["reference_error"]) + (f", so {percent(both)} with it" if np.isfinite(both) else "")
    rest = f"at 95 % of the nodes {percent(advice['p95_of_peak'])} at most"
    if advice["error"] == "force":
        peak = row["force_peak_error"]
        rest = f"the largest force is {percent(abs(peak))} too {'large' if peak > 0 else 'small'}"
    error = f"{percent(advice['rmse_of_peak'])} {WHERE[advice['error']]} over {advice['over']}"
    return f"{error}, from a standard {own}; {rest}"


def _wrong_itself(own: float) -> str:
    return f"that is {percent(own)} wrong itself" if np.isfinite(own) else "whose own error is not known"


def interval(advice: pd.Series) -> str:
    """Return between which limits the mean error lies; a scene that moves has one load, and so no limits."""
    if np.isnan(advice["error_low"]):
        return "of one load"
    low, high = percent(advice["error_low"]), percent(advice["error_high"])
    return low if low == high else f"{low} to {high}"


def bounded(advice: pd.Series) -> str:
    """Return below what a single answer's error stays, and what that rests on."""
    bound = percent(advice["bound_of_peak"])
    if not moves(advice):
        few = f"{advice['contacts']:.0f} contacts, {advice['presses']:.0f} presses"
        if not np.isfinite(advice["bound_of_peak"]):
            return f"none, as {few} are too few"
        return f"nine answers in ten at other contacts are wrong by less than {bound}, by {few} held out"
    if np.isnan(advice["bound_of_peak"]):
        return f"none, as {advice['bound_on']}"
    said = f"nine motions in ten, pushed as hard elsewhere, are wrong by less than {bound}"
    return f"{said}; measured on {advice['bound_on']}"


def exceeded(advice: pd.Series) -> str:
    """Explain that a row's error, or its bound where a body moves, exceeds the limit that it was chosen for."""
    if moves(advice):
        over = advice["bound_of_peak"] > advice["max_error"]
        what = f"pushed elsewhere, its error may be larger than asked, up to {percent(advice['bound_of_peak'])}"
    else:
        over = error_of(advice) > advice["max_error"]
        what = f"on the test contacts its error is larger than asked, {percent(error_of(advice))}"
    return what if over else ""


def pace(times_life: float) -> str:
    """Return how fast a motion is computed, as seconds of motion in a second: "35 × real time"."""
    return f"{two_digits(times_life)} × real time"


def behind(advice: pd.Series) -> str:
    """Compare the next best model of a row of advice.csv with the advised one: "has 4 times the error".

    Of errors the bounds are compared.
    """
    wrong, factor = timed(advice), advice["factor"]
    tie = EQUAL if wrong else TIED_TIMES
    if 1 / tie <= factor <= tie:
        return "is as accurate" if wrong else "is about as fast"
    times = two_digits(factor) if factor < 1000 else "over 1000"
    return f"has {times} times the {'bound' if wrong else 'time'}"


def next_best(advice: pd.Series) -> str:
    """Put the next best model of a row of advice.csv into a clause."""
    if not advice["factor"] > 0:
        return "no other model meets this limit"
    return f"the next best model, {label(advice['rival'], 'default')}, {behind(advice)}"
