"""List the advice of a finished run for the terminal, a line for each budget and error."""

import pandas as pd

from palpate.benchmark.comparison import KINDS
from palpate.report.model_looks import label
from palpate.report.number_format import percent, seconds
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_agreement import same_in
from palpate.studies.tradeoff.advice_words import WHERE, error_of, exceeded, limit
from palpate.studies.tradeoff.motion_words import brief, moves
from palpate.studies.tradeoff.motion_words import exceeded as beyond


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
    error, time = percent(error_of(row)), seconds(row["online_p95_s"])
    if moves(row):
        return f"{brief(row)} (beware: {more})" if (more := beyond(row)) else brief(row)
    bound = f" (nine in ten below {percent(row['bound_of_peak'])})" if row["bound_of_peak"] > 0 else ""
    said = f"{label(row['model'], row['setting'])}: {error}{bound}, {time}"
    return f"{said} (beware: {more})" if (more := exceeded(row)) else said
