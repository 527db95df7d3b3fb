"""List the advice of a finished run for the terminal, a line for each budget and error."""

import pandas as pd

from palpate.evaluation.tradeoff.advice import NONE
from palpate.figures.model_looks import label
from palpate.figures.number_format import percent, seconds
from palpate.report.advice_words import limit


def advice_list(advice: pd.DataFrame) -> str:
    """Return advice.csv as lines: each scene, and under it what to take for each limit, its error and its time."""
    width = max(len(limit(row)) for _, row in advice.iterrows())
    found = []
    for scene, rows in advice.groupby("scene", sort=False):
        found.append(f"Advice for {scene} (mean error as a share of the peak displacement; time of an answer):")
        found += [f"  {limit(row):{width}}  {_choice(row)}" for _, row in rows.iterrows()]
        # of moving scenes the reference's own error is that of its step, and is included; they have no interval
        own = rows["reference_error"].max() if rows["error_low"].notna().any() else 0.0
        if own > rows["rmse_of_peak"].min():
            found.append(f"  The mesh itself has an error of {percent(own)}, not included: to get below it, refine it.")
    return "\n".join(found).replace("\u00a0", " ")


def _choice(row: pd.Series) -> str:
    if row["model"] == NONE:
        return f"none: {row['why']}"
    error, time = percent(row["rmse_of_peak"]), seconds(row["online_p95_s"])
    return f"{label(row['model'], row['setting'])}: {error}, {time}"
