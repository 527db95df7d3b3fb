"""Advice as sentences, for the terminal and the report."""

import numpy as np
import pandas as pd

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_reasons import behind, name
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL
from palpate.figures.model_looks import label
from palpate.figures.number_format import percent, seconds


def told(advice: pd.Series, settings: pd.DataFrame) -> str:
    """Lines for the terminal about one row of advice.csv.

    settings : its scene's rows of accuracy_vs_time.csv, or of dynamic_accuracy.csv if it moves
    """
    if advice["model"] == NONE:
        return f"{advice['scene']}, {limit(advice)}: none\n  because   {advice['why']}".replace("\u00a0", " ")
    row = settings[(settings["model"] == advice["model"]) & (settings["knob"] == advice["knob"])].iloc[0]
    left = f"{percent(advice['margin'])} of the {'budget' if np.isfinite(advice['budget_ms']) else 'error'} to spare"
    spent = f"{seconds(advice['online_p95_s'])} at the 95th percentile, on the machine that filled the tables"
    if moves := "slower_than_life" in settings:
        step = seconds(1e-3 * row["ms_per_step"])
        spent = f"{row['slower_than_life']:.2g} s for a second of motion, {step} a step, {spent}"
    else:
        spent = f"{seconds(row['online_median_s'])} an answer, {spent}"
    drawn = "" if moves else " in 90 % of draws of the contacts"
    lines = [
        f"{advice['scene']}, {limit(advice)}: {name(advice)}",
        f"  error     {percent(advice['rmse_of_peak'])} of the peak displacement ({interval(advice)}{drawn}); "
        f"95 % of nodes {percent(advice['p95_of_peak'])} at most",
        f"  time      {spent}",
        f"  margin    {left}",
        f"  before    {_preparation(row['offline_s'])}" + ("" if moves else f", {row['memory_mb']:.3g} MB"),
        f"  because   {advice['why']}",
    ]
    return "\n".join(lines).replace("\u00a0", " ")


def _preparation(offline_s: float) -> str:
    return f"{seconds(offline_s)} of preparation" if offline_s > 0 else "nothing to prepare"


def sentence(advice: pd.Series) -> str:
    """One row of advice.csv for the report."""
    asked = limit(advice)
    asked = asked[:1].upper() + asked[1:]
    if advice["model"] == NONE:
        return f"{asked}: none, as {advice['why']}."
    timed = np.isfinite(advice["budget_ms"])
    spare = f", {percent(advice['margin'])} of the budget to spare" if timed else ""
    rival = "no other model would do"
    if advice["factor"] > 0:
        far = behind(advice["factor"], EQUAL, "wrong") if timed else behind(advice["factor"], CLOSE, "slow")
        rival = f"{label(advice['rival'], advice['rival_knob'])}, the next best model, is {far}"
    return (
        f"{asked}: {label(advice['model'], advice['knob'])}, {percent(advice['rmse_of_peak'])} of the peak off "
        f"({interval(advice)}) in {seconds(advice['online_p95_s'])} at the 95th percentile{spare}; {rival}."
    )


def limit(advice: pd.Series) -> str:
    """What was asked for: "within 16.7 ms" or "at most 1 % wrong"."""
    if np.isfinite(advice["budget_ms"]):
        return f"within {advice['budget_ms']:g}\u00a0ms"
    return f"at most {100 * advice['max_error']:.2g}\u00a0% wrong"


def interval(advice: pd.Series) -> str:
    """Between which the mean error lies; a scene that moves has one load, and so none."""
    if np.isnan(advice["error_low"]):
        return "of one load"
    low, high = percent(advice["error_low"]), percent(advice["error_high"])
    return low if low == high else f"{low} to {high}"
