"""Put advice into words, once: lines for the terminal, cells for the tables of the report."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.benchmark.advice import NONE, agreed, name, same_in
from palpate.benchmark.advice_other_loads import doubts
from palpate.benchmark.comparison import CLOSE, EQUAL, KINDS
from palpate.report.model_looks import label
from palpate.report.words import percent, seconds, two_digits

WHERE = {"rms": "of the peak displacement", "patch": "of the peak displacement at the patch"}
"""The meaning of each kind of error."""
_UNIT = "on the machine that filled the tables"


def lines(advice: pd.Series, rows: pd.DataFrame, splits: str = "") -> str:
    """Return lines for the terminal about one row of advice.csv.

    rows : its scene's and split's rows of accuracy_vs_time.csv, or its scene's of dynamic_accuracy.csv
    splits : how many of them advise the same, if there are several
    """
    head = f"{advice['scene']}, {limit(advice)}"
    if advice["model"] == NONE:
        return _lines(f"{head}: none", because=advice["why"])
    row = rows[(rows["model"] == advice["model"]) & (rows["setting"] == advice["setting"])].iloc[0]
    before = f"{seconds(row['offline_s'])} of preparation" if row["offline_s"] > 0 else "nothing to prepare"
    p95 = f"{seconds(advice['online_p95_s'])} at the 95th percentile, {_UNIT}"
    if moves(advice):
        told = row["estimate_of_peak"]
        found = {
            "error": moved_error(advice),
            "itself": f"says that it is wrong by {percent(told)}" if np.isfinite(told) else "",
            "bound": bounded(advice),
            "speed": f"{pace(advice['times_life'])}, {seconds(1e-3 * row['ms_per_step'])} a step, {p95}",
        }
    else:
        found = {
            "error": f"{percent(error_of(advice))} {WHERE[advice['error']]} "
            f"({interval(advice)} in 90 % of draws of the test contacts); {_other_error(advice)}",
            "bound": bounded(advice),
            "time": f"{seconds(row['online_median_s'])} an answer, {p95}",
        }
        before += f", {row['memory_mb']:.3g} MB"
    share = percent(advice["margin"]) if advice["margin"] > 0 else "nothing"
    margin = f"{share} of the allowed {'time' if timed(advice) else 'error'} is left"
    rest = {"margin": margin, "before": before, "agreed": splits, "because": advice["why"]}
    return _lines(f"{head}: {name(advice)}", beware=exceeded(advice), **found, **rest)


def any_load_lines(advice: pd.Series) -> str:
    """Return lines for the terminal about a kind of load."""
    head = f"{advice.scene}, {advice.kind}"
    if advice.model == NONE:
        return _lines(f"{head}: none", because=advice.why)
    force = f"; of the force {percent(advice.force_error)}" if np.isfinite(advice.force_error) else ""
    share = percent(advice.doubted / advice.samples)
    count = f"{advice.doubted} of {advice.samples} loads ({share})"
    return _lines(
        f"{head}: {name(advice)}",
        error=f"{percent(advice.error_of_peak)} of the peak displacement, {percent(advice.most)} at most{force}; "
        "against the fine operator, whose own error comes on top",
        bound=f"{'of those that it answers, ' if advice.doubted else ''}{percent(advice.sure)} of such loads at "
        f"another place are answered with an error of less than {percent(advice.most)}, the largest that was found",
        doubts=f"{count}: it says that it does not know, and gives no answer" if advice.doubted else "",
        time=f"{seconds(advice.online_p95_s)} at the 95th percentile",
        before=f"{seconds(advice.offline_s)} of preparation"
        + (f", {seconds(advice.preparation_s)} for a new press" if advice.preparation_s > 0 else ""),
        because=advice.why,
    )


def _lines(head: str, **said: str) -> str:
    """Return the head and, indented, what is said of each; what is empty is left out."""
    rows = [head, *(f"  {key:<8}  {text}" for key, text in said.items() if text)]
    return "\n".join(rows).replace("\u00a0", " ")


def advice_list(advice: pd.DataFrame, kind: str = "rms") -> str:
    """Return advice.csv as lines: each scene, and under it what to take for each limit, its error, bound and time.

    kind : of the errors; advice is that of the first split, with how many others agree
    """
    advice = advice[advice["error"] == kind]
    if advice.empty:
        return "No scene has advice about that kind of error."
    width = max(len(limit(row)) for _, row in advice.iterrows())
    found = []
    for scene, rows in advice.groupby("scene", sort=False):
        found.append(f"Advice for {scene} (mean error as a share {WHERE[kind]}; time of an answer):")
        for _, asked in rows.groupby(["budget_ms", "max_error", "speed"], sort=False, dropna=False):
            found.append(f"  {limit(asked.iloc[0]):{width}}  {_choice(asked.iloc[0])}{_agreed(asked)}")
        # of moving scenes the reference's own error is that of its step, and is included; they have no interval
        own = rows["reference_error"].max() if rows["error_low"].notna().any() else 0.0
        if own > rows[[KINDS[kind], "max_error"]].min(axis=None):
            found.append(f"  The truth is known to {percent(own)}: below that, models are tied.")
    return "\n".join(found).replace("\u00a0", " ")


def _agreed(asked: pd.DataFrame) -> str:
    same, splits = same_in(asked)
    what = "none" if asked["model"].iloc[0] == NONE else "the same model"
    return f" ({what} in {same} of {splits} splits)" if splits > 1 else ""


def _choice(row: pd.Series) -> str:
    if row["model"] == NONE:
        return f"none: {row['why']}"
    if moves(row):
        said = moved_cell(row)
    else:
        bound = f" (nine in ten below {percent(row['bound_of_peak'])})" if row["bound_of_peak"] > 0 else ""
        error, time = percent(error_of(row)), seconds(row["online_p95_s"])
        said = f"{label(row['model'], row['setting'])}: {error}{bound}, {time}"
    return f"{said} (beware: {more})" if (more := exceeded(row)) else said


def moved_cell(advice: pd.Series) -> str:
    """Return model, error, its bound and its speed in a scene that moves, for a cell of a table."""
    if advice["model"] == NONE:
        return "none"
    bound = f", elsewhere below {percent(advice['bound_of_peak'])}" if np.isfinite(advice["bound_of_peak"]) else ""
    error = percent(advice["rmse_of_peak"])
    return f"{label(advice['model'], advice['setting'])}: {error}{bound}, {pace(advice['times_life'])}"


def any_load_cell(advice: pd.Series) -> str:
    """Return model, mean and largest error, and time for a kind of load, for a cell of a table."""
    if advice.model == NONE:
        return "none"
    error = f"{percent(advice.error_of_peak)}, at most {percent(advice.most)}"
    said = f"{label(advice.model, advice.setting)}: {error}, in {seconds(advice.online_p95_s)}"
    return f"{said}, {doubts(advice)}" if advice.doubted else said


def by_limit(advice: pd.DataFrame, names: dict[str, str], cell: Callable[[pd.Series], str]) -> pd.DataFrame:
    """Tabulate advice: a row for each scene of ``names``, a column for each limit, cells as ``cell`` puts them."""
    if advice.empty:
        return pd.DataFrame()
    limits = pd.Series([limit(row) for _, row in advice.iterrows()], index=advice.index, dtype=object)
    wide = advice.assign(taken=[cell(row) for _, row in advice.iterrows()], limit=limits)
    wide = wide.pivot(index="scene", columns="limit", values="taken")
    return wide.reindex(index=list(names), columns=pd.unique(limits)).rename(index=names).reset_index()


def limit(advice: pd.Series) -> str:
    """Return what was asked for: "within 16.7 ms", "error of at most 1 %" or "20 times as fast as life"."""
    if np.isfinite(advice.get("speed", np.nan)):  # what is tabulated of presses alone has no speed
        return f"{advice['speed']:g} times as fast as life"
    if np.isfinite(advice["budget_ms"]):
        return f"within {advice['budget_ms']:g}\u00a0ms"
    return f"error of at most {100 * advice['max_error']:.2g}\u00a0%"


def timed(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a time or a speed, and not about an error."""
    return bool(np.isnan(advice["max_error"]))


def moves(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a scene that moves."""
    return bool(np.isfinite(advice["times_life"]))


def error_of(advice: pd.Series) -> float:
    """Return the error on test contacts of the kind that a row of advice.csv is about."""
    return float(advice[KINDS[advice["error"]]])


def moved_error(advice: pd.Series) -> str:
    """Return the error of a motion in words, of the scene's own push."""
    both = advice["rmse_of_peak"] + advice["reference_error"]
    return (
        f"{percent(advice['rmse_of_peak'])} of the peak displacement over the whole motion; with the reference's own "
        f"{percent(advice['reference_error'])} added, {percent(both)}; at 95 % of the nodes "
        f"{percent(advice['p95_of_peak'])} at most"
    )


def _other_error(advice: pd.Series) -> str:
    if advice["error"] == "patch":
        return f"over the whole surface {percent(advice['rmse_of_peak'])}"
    return f"at the patch {percent(advice['patch_rms_of_peak'])}"


def interval(advice: pd.Series) -> str:
    """Return between which limits the mean error lies; a scene that moves has one load, and so no limits."""
    if np.isnan(advice["error_low"]):
        return "of one load"
    low, high = percent(advice["error_low"]), percent(advice["error_high"])
    return low if low == high else f"{low} to {high}"


def bounded(advice: pd.Series) -> str:
    """Return below what a single answer's error stays; of presses nothing where too few contacts were asked for."""
    bound = percent(advice["bound_of_peak"])
    if not moves(advice):
        known = np.isfinite(advice["bound_of_peak"])
        return f"nine answers in ten at other contacts are wrong by less than {bound}" if known else ""
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
    """Return how fast a motion is computed: "35 times as fast as life", or "2.4 times slower than life"."""
    fast = times_life >= 1
    return f"{two_digits(times_life if fast else 1 / times_life)} times {'as fast as' if fast else 'slower than'} life"


def behind(advice: pd.Series) -> str:
    """Compare the next best model of a row of advice.csv with the advised one: "has 4 times the error".

    It was the next best on validation contacts, and may have the smaller error on test contacts.
    """
    wrong, factor = timed(advice), advice["factor"]
    tie = EQUAL if wrong else CLOSE
    if 1 / tie <= factor <= tie:
        return "is as accurate" if wrong else "is about as fast"
    times = two_digits(factor) if factor < 1000 else "over 1000"
    less = " on test contacts" if factor < 1 else ""
    return f"has {times} times the error{less}" if wrong else f"takes {times} times as long"


def next_best(advice: pd.Series) -> str:
    """Put the next best model of a row of advice.csv into a clause."""
    if not advice["factor"] > 0:
        return "no other model meets this limit"
    return f"the next best model, {label(advice['rival'], 'default')}, {behind(advice)}"


def agreement_words(agreement: pd.DataFrame) -> str:
    """Put into a sentence how often splits advise the same model, of the rows of advice_agreement.csv."""
    mean, whole, count = agreed(agreement)
    splits = int(agreement["splits"].max())
    return (
        f"Of the {count} questions that have an answer, {mean * splits:.2g} of {splits} splits advise the same model "
        f"on average, and all of them in {percent(whole)}."
    )
