"""Choose from the settings that fit a limit, and compare the choice with the others, as fields of an ``Advice``."""

import pandas as pd

from palpate.evaluation.tradeoff import advice_reasons as reasons
from palpate.evaluation.tradeoff.equal_settings import CLOSE, pick


def choice(fits: pd.DataFrame, by: dict[str, float]) -> tuple[pd.Series, pd.Series | None]:
    """Choose the best, and the best of all other models, if there are any."""
    best = pick(fits, by)
    others = fits[fits["model"] != best["model"]]
    return best, None if others.empty else pick(others, by)


def versus(best: pd.Series, rival: pd.Series | None, column: str) -> dict:
    """Compare ``rival`` in ``column``, as fields of an ``Advice``; none where there is no other."""
    if rival is None:
        return {}
    factor = reasons.ratio(rival, best, column)
    return {"rival": rival["model"], "rival_setting": rival["setting"], "factor": factor}


def passed_over(able: pd.DataFrame, high: pd.Series, best: pd.Series, column: str, max_error: float) -> dict:
    """Find the fastest of what is clearly faster in ``column`` than ``best``, with an error below ``max_error``.

    high : up to where the error of each of ``able`` may be. As fields of an ``Advice``; none where there is none
    """
    passed = able[(able["rmse_of_peak"] <= max_error) & (CLOSE * able[column] < best[column])]
    if passed.empty:
        return {}
    row = passed.loc[passed[column].idxmin()]
    found = {"faster": row["model"], "faster_setting": row["setting"], "faster_error": row["rmse_of_peak"]}
    return found | {"faster_high": high[row.name], "faster_factor": best[column] / row[column]}
