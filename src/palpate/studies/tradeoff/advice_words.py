"""Put advice into sentences, for the terminal and the report."""

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import CLOSE, EQUAL, KINDS
from palpate.report.model_looks import label
from palpate.report.names import plain
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_agreement import agreed
from palpate.studies.tradeoff.advice_reasons import name

WHERE = {"rms": "of the peak displacement", "patch": "of the peak displacement at the patch"}
"""The meaning of each kind of error."""


def lines(advice: pd.Series, settings: pd.DataFrame, splits: str = "") -> str:
    """Return lines for the terminal about one row of advice.csv.

    settings : its scene's and split's rows of accuracy_vs_time.csv
    splits : how many of them advise the same, if there are several
    """
    if advice["model"] == NONE:
        return refusal(advice)
    row = advised(advice, settings)
    spent = f"{seconds(advice['online_p95_s'])} at the 95th percentile, on the machine that filled the tables"
    found = [
        f"{advice['scene']}, {limit(advice)}: {name(advice)}",
        *([f"  beware    {more}"] if (more := exceeded(advice)) else []),
        f"  error     {percent(error_of(advice))} {WHERE[advice['error']]} "
        f"({interval(advice)} in 90 % of draws of the test contacts); {_also(advice)}",
        *([f"  bound     {bound}"] if (bound := bounded(advice)) else []),
        f"  time      {seconds(row['online_median_s'])} an answer, {spent}",
        f"  margin    {left(advice)}",
        f"  before    {preparation(row['offline_s'])}, {row['memory_mb']:.3g} MB",
        *([f"  agreed    {splits}"] if splits else []),
        f"  because   {advice['why']}",
    ]
    return "\n".join(found).replace("\u00a0", " ")


def refusal(advice: pd.Series) -> str:
    """Return lines for the terminal about a row of advice.csv that advises nothing."""
    return f"{advice['scene']}, {limit(advice)}: none\n  because   {advice['why']}".replace("\u00a0", " ")


def advised(advice: pd.Series, settings: pd.DataFrame) -> pd.Series:
    """Return the row of ``settings`` that a row of advice.csv advises."""
    return settings[(settings["model"] == advice["model"]) & (settings["setting"] == advice["setting"])].iloc[0]


def timed(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a time or a speed, and not about an error."""
    return bool(np.isnan(advice["max_error"]))


def error_of(advice: pd.Series) -> float:
    """Return the error on test contacts of the kind that a row of advice.csv is about."""
    return float(advice[KINDS[advice["error"]]])


def bounded(advice: pd.Series) -> str:
    """Return below what a single answer's error stays, in words; nothing where too few contacts were asked for."""
    if np.isnan(advice["bound_of_peak"]):
        return ""
    return f"nine answers in ten at other contacts are wrong by less than {percent(advice['bound_of_peak'])}"


def exceeded(advice: pd.Series) -> str:
    """Explain that a row's error on test contacts exceeds the limit that it was chosen for; nothing if it does not."""
    if not error_of(advice) > advice["max_error"]:
        return ""
    return f"on the test contacts its error is larger than asked, {percent(error_of(advice))}"


def left(advice: pd.Series) -> str:
    """Return what is left of the limit that a row of advice.csv is about, in words."""
    share = percent(advice["margin"]) if advice["margin"] > 0 else "nothing"
    return f"{share} of the allowed {'time' if timed(advice) else 'error'} is left"


def _also(advice: pd.Series) -> str:
    """Return the error of the other kind."""
    if advice["error"] == "patch":
        return f"over the whole surface {percent(advice['rmse_of_peak'])}"
    return f"at the patch {percent(advice['patch_rms_of_peak'])}"


def preparation(offline_s: float) -> str:
    """Return how long the preparation takes, in words."""
    return f"{seconds(offline_s)} of preparation" if offline_s > 0 else "nothing to prepare"


def sentence(advice: pd.Series) -> str:
    """Put one row of advice.csv into a sentence for the report."""
    asked = capital(limit(advice))
    if advice["model"] == NONE:
        return f"{asked}: none, because {plain(advice['why'])}."
    spare = f", which leaves {percent(advice['margin'])} of the time" if timed(advice) else ""
    return (
        f"{asked}: {label(advice['model'], advice['setting'])}. "
        f"{capital(more) + '. ' if (more := exceeded(advice)) else ''}"
        f"Its error{_at(advice)} is {percent(error_of(advice))} "
        f"({interval(advice)}), its time {seconds(advice['online_p95_s'])} at the 95th percentile{spare}. "
        f"{capital(bound) + '. ' if (bound := bounded(advice)) else ''}"
        f"{capital(next_best(advice))}.{terms(advice)}"
    )


def _at(advice: pd.Series) -> str:
    return " at the patch" if advice["error"] == "patch" else ""


def terms(advice: pd.Series) -> str:
    """Name what is faster and was passed over, what is added to the error, and where the truth is not known."""
    own, said = advice["reference_error"], ""
    if advice["faster_factor"] > 0:
        who = capital(label(advice["faster"], advice["faster_setting"]))
        said += (
            f" {who} is {_times(advice['faster_factor'])} times as fast and was passed over, as its error of "
            f"{percent(advice['faster_error'])} may be up to {percent(advice['faster_high'])}."
        )
    if np.isnan(advice["error_low"]):
        if np.isfinite(own) and np.isfinite(advice["max_error"]):
            said += f" The error that is judged includes the reference's own, {percent(own)}."
    elif own > error_of(advice):
        said += f" Below {percent(own)}, the truth's own error, models are tied and the fastest is taken."
    return said


def next_best(advice: pd.Series, setting: bool = True) -> str:
    """Put the next best model of a row of advice.csv into a clause, with its setting or without."""
    if not advice["factor"] > 0:
        return "no other model meets this limit"
    rival = label(advice["rival"], advice["rival_setting"] if setting else "default")
    return f"the next best model, {rival}, {behind(advice)}"


def behind(advice: pd.Series) -> str:
    """Compare the next best model of a row of advice.csv with the advised one: "has 4 times the error".

    It was the next best on validation contacts, and may have the smaller error on test contacts.
    """
    wrong, factor = timed(advice), advice["factor"]
    tie = EQUAL if wrong else CLOSE
    if 1 / tie <= factor <= tie:
        return "is as accurate" if wrong else "is about as fast"
    times = _times(factor) if factor < 1000 else "over 1000"
    less = " on test contacts" if factor < 1 else ""
    return f"has {times} times the error{less}" if wrong else f"takes {times} times as long"


def _times(factor: float) -> str:
    return f"{float(f'{factor:.2g}'):g}"


def limit(advice: pd.Series) -> str:
    """Return what was asked for: "within 16.7 ms", "error of at most 1 %" or "20 times as fast as life"."""
    if np.isfinite(advice.get("speed", np.nan)):  # what is tabulated of presses alone has no speed
        return f"{advice['speed']:g} times as fast as life"
    if np.isfinite(advice["budget_ms"]):
        return f"within {advice['budget_ms']:g}\u00a0ms"
    return f"error of at most {100 * advice['max_error']:.2g}\u00a0%"


def interval(advice: pd.Series) -> str:
    """Return between which limits the mean error lies; a scene that moves has one load, and so no limits."""
    if np.isnan(advice["error_low"]):
        return "of one load"
    low, high = percent(advice["error_low"]), percent(advice["error_high"])
    return low if low == high else f"{low} to {high}"


def agreement_words(agreement: pd.DataFrame) -> str:
    """Put into a sentence how often splits advise the same model, of the rows of advice_agreement.csv."""
    mean, whole, count = agreed(agreement)
    splits = int(agreement["splits"].max())
    return (
        f"Of the {count} questions that have an answer, {mean * splits:.2g} of {splits} splits advise the same model "
        f"on average, and all of them in {percent(whole)}."
    )
