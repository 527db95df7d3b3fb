"""Choose from the settings that fit a limit, and compare the choice with the others, as fields of an ``Advice``."""

from collections.abc import Mapping

import pandas as pd

from palpate.benchmark.comparison import CLOSE, EXACT, pick
from palpate.studies.tradeoff import advice_reasons as reasons


def choice(fits: pd.DataFrame, by: Mapping[str, float], floor: float = EXACT) -> tuple[pd.Series, pd.Series | None]:
    """Choose the best, and the best of all other models, if there are any; errors below ``floor`` are tied."""
    best = pick(fits, by, floor)
    others = fits[fits["model"] != best["model"]]
    return best, None if others.empty else pick(others, by, floor)


def versus(best: pd.Series, rival: pd.Series | None, column: str, floor: float = EXACT) -> dict:
    """Compare ``rival`` in ``column``, as fields of an ``Advice``; none where there is no other."""
    if rival is None:
        return {}
    factor = reasons.ratio(rival, best, column, floor)
    return {"rival": rival["model"], "rival_setting": rival["setting"], "factor": factor}


def passed_over(
    able: pd.DataFrame, high: pd.Series, best: pd.Series, column: str, max_error: float, error: str = "rmse_of_peak"
) -> dict:
    """Find the fastest of what is clearly faster in ``column`` than ``best``, with an ``error`` below ``max_error``.

    high : up to where the error of each of ``able`` may be. As fields of an ``Advice``; none where there is none
    """
    passed = able[(able[error] <= max_error) & (CLOSE * able[column] < best[column])]
    if passed.empty:
        return {}
    row = passed.loc[passed[column].idxmin()]
    found = {"faster": row["model"], "faster_setting": row["setting"], "faster_error": row[error]}
    return found | {"faster_high": high[row.name], "faster_factor": best[column] / row[column]}
