"""Explain in a sentence, with its numbers, why a model is advised or none is."""

import pandas as pd

from palpate.evaluation.tradeoff.bootstrap import EXTRAPOLATED, RANGE, TRUTH
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL, EXACT

MARGIN = 0.2
"""Share of a budget that the 95th percentile of the time must leave free: it repeats less well than the median."""


def mesh_error(settings: pd.DataFrame) -> float:
    """Return the error of the fine mesh itself, as a share of the peak; NaN where it was not measured."""
    return settings.loc[(settings["model"] == TRUTH) & (settings["setting"] == EXTRAPOLATED), "rmse_of_peak"].max()


def within(
    best: pd.Series,
    rival: pd.Series | None,
    confidence: float,
    fits: pd.DataFrame,
    settings: pd.DataFrame,
    budget_ms: float,
) -> str:
    """Explain ``best`` of what ``fits`` a budget."""
    parts = [
        f"least error of {counted(fits)} whose 95th percentile leaves {_share(MARGIN)} of {budget_ms:g} ms unused",
        f"best, or tied with the best, in {_share(confidence)} of draws of the contacts",
        next_best(rival, best, "rmse_of_peak"),
    ]
    late = settings[(settings["failures"] == 0) & (settings["rmse_of_peak"] < best["rmse_of_peak"])]
    late = late[(1e3 * late["online_p95_s"]).between((1 - MARGIN) * budget_ms, budget_ms)]
    if len(late):
        close = late.loc[late["rmse_of_peak"].idxmin()]
        parts.append(
            f"{name(close)} has a smaller error ({percent(close['rmse_of_peak'])}) "
            f"but too close to the budget ({_ms(close['online_p95_s'])})"
        )
    return "; ".join([*parts, *_mesh(best["rmse_of_peak"], settings), *_failed(settings)])


def late(able: pd.DataFrame, settings: pd.DataFrame, budget_ms: float) -> str:
    """Explain why nothing fits a budget."""
    if able.empty:
        return "; ".join(["no setting has answered every sample", *_failed(settings)])
    fastest = able.loc[able["online_p95_s"].idxmin()]
    need = f"{(1 - MARGIN) * budget_ms:.3g} ms are what leaves {_share(MARGIN)} of the budget free"
    told = f"the fastest setting, {name(fastest)}, takes {_ms(fastest['online_p95_s'])} at the 95th percentile"
    return "; ".join([f"{told}, and {need}", *_failed(settings)])


def under(
    best: pd.Series, rival: pd.Series | None, passed: dict, fits: pd.DataFrame, settings: pd.DataFrame, limit: float
) -> str:
    """Explain ``best`` of what stays under an error; passed : fields of an ``Advice`` about what is faster."""
    parts = [
        f"fastest of {counted(fits)} with a mean error that stays below {percent(limit)} "
        f"in {_share(RANGE[1])} of draws of the contacts",
        next_best(rival, best, "online_median_s"),
        *passed_over(passed, f"in {_share(RANGE[1])} of draws it is not more"),
    ]
    return "; ".join([*parts, *_mesh(best["rmse_of_peak"], settings, limit), *_failed(settings)])


def wrong(able: pd.DataFrame, highest: pd.Series, settings: pd.DataFrame, limit: float) -> str:
    """Explain why nothing stays under an error; highest : what each of ``able`` stays below in 95 % of draws."""
    if able.empty:
        return "; ".join(["no setting has answered every sample", *_failed(settings)])
    least = able.loc[highest.idxmin()]
    told = f"the setting of least error, {name(least)}, has a mean error of {percent(least['rmse_of_peak'])}"
    sure = f"stays below {percent(highest.min())} in {_share(RANGE[1])} of draws of the contacts"
    return "; ".join([f"{told} and {sure}", *_mesh(limit, settings), *_failed(settings)])


def passed_over(passed: dict, known: str) -> list[str]:
    """Explain why what is faster was passed over, if anything was; known : how its largest error is known."""
    if not passed:
        return []
    who = name(pd.Series({"model": passed["faster"], "setting": passed["faster_setting"]}))
    return [
        f"{who} is {passed['faster_factor']:.2g} times as fast and was passed over: its error, "
        f"{percent(passed['faster_error'])}, may be up to {percent(passed['faster_high'])} ({known})"
    ]


def name(setting: pd.Series) -> str:
    """Name model and setting as the tables do."""
    return setting["model"] if setting["setting"] == "default" else f"{setting['model']} {setting['setting']}"


def ratio(rival: pd.Series, best: pd.Series, column: str) -> float:
    """Return how many times as much the rival has; errors below EXACT count as that."""
    least = EXACT if column == "rmse_of_peak" else 0
    return max(rival[column], least) / max(best[column], least)


def behind(factor: float, tie: float, what: str) -> str:
    """Describe how far a rival is behind: "has 4 times the error", or "is equal" within the factor ``tie``."""
    if 1 / tie <= factor <= tie:
        return "is equal within the spread of runs"
    return f"has {factor:.3g} times the {what}" if factor < 1000 else f"has over 1000 times the {what}"


def next_best(rival: pd.Series | None, best: pd.Series, column: str) -> str:
    """Name the best of the other models, and how far it is behind in ``column``, an error or a time."""
    if rival is None:
        return "no other model meets the limit"
    tie, what = (EQUAL, "error") if column == "rmse_of_peak" else (CLOSE, "time")
    return f"the next best model, {name(rival)}, {behind(ratio(rival, best, column), tie, what)}"


def _mesh(error: float, settings: pd.DataFrame, limit: float = 0.0) -> list[str]:
    """Advise to refine the mesh where its own error is larger than ``error``, which is against it, and than ``limit``.

    Where it is only larger than ``error``, tell that it is not included.
    """
    own = mesh_error(settings)
    if not error < own:  # or not known
        return []
    return [
        f"refine the mesh: its own error, {percent(own)}, is larger and not included"
        if own > limit
        else f"the error of the mesh itself, {percent(own)}, is not included"
    ]


def _failed(settings: pd.DataFrame) -> list[str]:
    count = int((settings["failures"] > 0).sum())
    return [f"settings left out as they failed on some samples: {count}"] if count else []


def counted(rows: pd.DataFrame) -> str:
    """Return how many settings there are, in words."""
    return "one setting" if len(rows) == 1 else f"{len(rows)} settings"


def _share(share: float) -> str:
    return f"{100 * share:.0f} %"


def percent(share: float) -> str:
    """Return a share in per cent, with two digits."""
    return f"{100 * share:.2g} %"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
