"""Put the advice for one scene into the answer at the top of the report, for a newcomer."""

from itertools import groupby

import numpy as np
import pandas as pd

from palpate.benchmark.advice import NONE
from palpate.report.model_looks import label
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital, listed
from palpate.studies.tradeoff.advice_words import exceeded, next_best
from palpate.studies.tradeoff.figures.scene_rows import answers

MEANINGS = {
    1.0: "fast enough for force feedback to a hand",
    16.7: "one picture at 60 a second",
    100.0: "still felt as immediate",
}
"""What a budget [ms] is for."""


def answer(advice: pd.DataFrame, settings: pd.DataFrame, what: dict[str, str]) -> list[str]:
    """Put the advice for one scene into a few sentences that a newcomer understands: of errors over the surface.

    advice : its rows of advice.csv, of which those of the first split are taken
    settings : its rows of accuracy_vs_time.csv; what : a few words on what each model does
    """
    advice = advice[advice["error"] == "rms"]
    advice = advice[advice["split"] == advice["split"].min()]
    settings = settings[settings["split"] == settings["split"].min()]
    medians = settings.set_index(["model", "setting"])["online_median_s"]
    rows = [row for _, row in advice.iterrows()]
    timed = [row for row in rows if np.isfinite(row["budget_ms"])]
    exact = [row for row in rows if not np.isfinite(row["budget_ms"])]
    found = [_within(same, medians, what) for same in _alike(timed)]
    met = [_under(same, settings) for same in _alike(exact)]
    if met:
        found.append(f"{capital('; '.join(met))}.")
    return found


def _alike(rows: list[pd.Series]) -> list[list[pd.Series]]:
    """Group neighbouring rows of advice.csv that advise the same."""
    return [list(same) for _, same in groupby(rows, lambda row: (row["model"], row["setting"]))]


def _within(rows: list[pd.Series], medians: pd.Series, what: dict[str, str]) -> str:
    """Put budgets that get the same answer into a sentence."""
    budgets = listed([f"{row['budget_ms']:g}\u00a0ms{_meaning(row['budget_ms'])}" for row in rows])
    first = rows[0]
    if first["model"] == NONE:
        return f"Within {budgets}, no model answers in time."
    gloss = f" ({what[first['model']]})" if first["model"] in what else ""
    return (
        f"Within {budgets}, take {label(first['model'], 'default')}{gloss}: its error is "
        f"{percent(first['rmse_of_peak'])}, its time {_median(first, medians)}; {next_best(first, setting=False)}."
    )


def _median(row: pd.Series, medians: pd.Series) -> str:
    return seconds(medians[row["model"], row["setting"]])


def _meaning(budget_ms: float) -> str:
    return f" ({MEANINGS[budget_ms]})" if budget_ms in MEANINGS else ""


def _under(rows: list[pd.Series], settings: pd.DataFrame) -> str:
    """Put limits of the error that get the same answer into a clause."""
    limits = f"for an error of at most {listed([percent(row['max_error']) for row in rows])}"
    first = rows[0]
    if first["model"] == NONE:
        return f"{limits}, {_none(rows, settings)}"
    time = _median(first, settings.set_index(["model", "setting"])["online_median_s"])
    more = next(filter(None, map(exceeded, rows)), "")
    return f"{limits}, take {label(first['model'], 'default')} ({time}{'; ' + more if more else ''})"


def _none(rows: list[pd.Series], settings: pd.DataFrame) -> str:
    """Explain that no model is sure to be exact enough, by what the least error is, and how well the truth is known."""
    own = rows[0]["reference_error"]
    known = f"; the truth: {percent(own)}" if any(own > row["max_error"] for row in rows) else ""
    able = answers(settings)
    able = able[able["failures"] == 0].dropna(subset="validation_rmse_of_peak")
    if able.empty:
        return f"no model has answered every sample{known}"
    least = able.loc[able["rmse_of_peak"].idxmin()]
    test, chosen = percent(least["rmse_of_peak"]), percent(least["validation_rmse_of_peak"])
    who = label(least["model"], "default")
    return f"none is sure to be ({who}: {test} on test, {chosen} on validation{known})"
