"""Put advice for a scene that moves into sentences: the same for the terminal and the report."""

import numpy as np
import pandas as pd

from palpate.report.model_looks import label
from palpate.report.names import plain
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_reasons import name
from palpate.studies.tradeoff.advice_words import advised, left, limit, next_best, preparation, refusal, terms, timed


def moves(advice: pd.Series) -> bool:
    """Return whether a row of advice.csv is about a scene that moves."""
    return bool(np.isfinite(advice["times_life"]))


def pace(times_life: float) -> str:
    """Return how fast a motion is computed: "35 times as fast as life", or "2.4 times slower than life"."""
    if times_life >= 1:
        return f"{_two(times_life)} times as fast as life"
    return f"{_two(1 / times_life)} times slower than life"


def _two(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def wrong(advice: pd.Series) -> str:
    """Return the error of a motion in words, of the scene's own push."""
    both = advice["rmse_of_peak"] + advice["reference_error"]
    return (
        f"{percent(advice['rmse_of_peak'])} of the peak displacement over the whole motion; with the reference's own "
        f"{percent(advice['reference_error'])} added, {percent(both)}; at 95 % of the nodes "
        f"{percent(advice['p95_of_peak'])} at most"
    )


def bounded(advice: pd.Series) -> str:
    """Return below what the error stays where the push is elsewhere, and on what that was measured, in words."""
    if np.isnan(advice["bound_of_peak"]):
        return f"none, as {advice['bound_on']}"
    return (
        f"nine motions in ten, pushed as hard elsewhere, are wrong by less than {percent(advice['bound_of_peak'])}; "
        f"measured on {advice['bound_on']}"
    )


def exceeded(advice: pd.Series) -> str:
    """Explain that a push elsewhere may be more wrong than asked; nothing if its bound is not."""
    if not advice["bound_of_peak"] > advice["max_error"]:
        return ""
    return f"pushed elsewhere, its error may be larger than asked, up to {percent(advice['bound_of_peak'])}"


def lines(advice: pd.Series, motions: pd.DataFrame) -> str:
    """Return lines for the terminal about one row of advice.csv; motions : its scene's rows of dynamic_accuracy.csv."""
    if advice["model"] == NONE:
        return refusal(advice)
    row = advised(advice, motions)
    told = row["estimate_of_peak"]
    found = [
        f"{advice['scene']}, {limit(advice)}: {name(advice)}",
        *([f"  beware    {more}"] if (more := exceeded(advice)) else []),
        f"  error     {wrong(advice)}",
        *([f"  itself    says that it is wrong by {percent(told)}"] if np.isfinite(told) else []),
        f"  bound     {bounded(advice)}",
        f"  speed     {pace(advice['times_life'])}, {seconds(1e-3 * row['ms_per_step'])} a step, "
        f"{seconds(advice['online_p95_s'])} at the 95th percentile, on the machine that filled the tables",
        f"  margin    {left(advice)}",
        f"  before    {preparation(row['offline_s'])}",
        f"  because   {advice['why']}",
    ]
    return "\n".join(found).replace("\u00a0", " ")


def sentence(advice: pd.Series) -> str:
    """Put one row of advice.csv into a sentence for the report."""
    asked = capital(limit(advice))
    if advice["model"] == NONE:
        return f"{asked}: none, because {plain(advice['why'])}."
    spare = f", which leaves {percent(advice['margin'])} of the time" if timed(advice) else ""
    return (
        f"{asked}: {label(advice['model'], advice['setting'])}. "
        f"{capital(more) + '. ' if (more := exceeded(advice)) else ''}"
        f"Its error is {wrong(advice)}. Its bound: {bounded(advice)}. Its speed: {pace(advice['times_life'])}, "
        f"{seconds(advice['online_p95_s'])} a step at the 95th percentile{spare}. "
        f"{capital(next_best(advice))}.{terms(advice)}"
    )


def brief(advice: pd.Series) -> str:
    """Return model, error, its bound and its speed for a cell of a table."""
    if advice["model"] == NONE:
        return "none"
    bound = f", elsewhere below {percent(advice['bound_of_peak'])}" if np.isfinite(advice["bound_of_peak"]) else ""
    error = percent(advice["rmse_of_peak"])
    return f"{label(advice['model'], advice['setting'])}: {error}{bound}, {pace(advice['times_life'])}"
