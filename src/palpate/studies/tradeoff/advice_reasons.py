"""Explain in a sentence, with its numbers, why a model is advised or none is."""

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import BOUNDS, CLOSE, EQUAL, EXACT, RANGE, TRUTH

MARGIN = 0.2
"""Share of a budget that the 95th percentile of the time must leave free: it repeats less well than the median."""


UNSURE = 0.5
"""Share of draws below which a choice is not called the best: another was, more often than not."""


class Known:
    """The knowledge that a split's rows of accuracy_vs_time.csv hold about one kind of error.

    settings : the rows; column : of the errors on test samples; chosen_by : of those on validation samples
    own : the truth's own error, the larger of that on the test and on the validation samples; NaN where not known
    floor : below which errors cannot be told apart: that, or what nobody could measure
    choosing : the same of the errors that settings are chosen by, on validation samples alone
    where : the samples on which the truth is known less well, in words
    """

    def __init__(self, settings: pd.DataFrame, column: str):
        self.settings, self.column, self.chosen_by = settings, column, f"validation_{column}"
        tests, chooses = truth_error(settings, column), truth_error(settings, self.chosen_by)
        self.own = float(np.fmax(tests, chooses))
        self.floor, self.choosing = (float(np.fmax(EXACT, each)) for each in (self.own, chooses))
        self.where = "validation contacts" if chooses > tests else "test contacts"


def truth_error(settings: pd.DataFrame, column: str = "rmse_of_peak") -> float:
    """Return the truth's own error in ``column``, of several rows the largest; NaN where it was not measured."""
    return settings.loc[settings["model"] == TRUTH, column].max()


def within(
    best: pd.Series, rival: pd.Series | None, confidence: float, fits: pd.DataFrame, known: Known, budget_ms: float
) -> str:
    """Explain ``best`` of what ``fits`` a budget."""
    parts = [
        f"least validation error of {counted(fits)} whose 95th percentile leaves {_share(MARGIN)} of {budget_ms:g} ms "
        "unused",
        _sure(confidence, rival),
        next_best(rival, best, known.column, known.floor),
    ]
    settings = known.settings[~known.settings["model"].isin(BOUNDS)]
    late = settings[(settings["failures"] == 0) & (settings[known.chosen_by] < best[known.chosen_by])]
    late = late[(1e3 * late["online_p95_s"]).between((1 - MARGIN) * budget_ms, budget_ms)]
    if len(late) and best[known.chosen_by] > known.floor:
        close = late.loc[late[known.chosen_by].idxmin()]
        parts.append(
            f"{name(close)} has a smaller error ({percent(close[known.column])}) "
            f"but too close to the budget ({_ms(close['online_p95_s'])})"
        )
    return "; ".join([*parts, *_truth(best[known.chosen_by], known), *_failed(settings)])


def _sure(confidence: float, rival: pd.Series | None) -> str:
    """Explain how often a choice is the best of what fits, or that it hardly differs from the others."""
    if confidence < UNSURE:
        who = name(rival) if rival is not None else "its other settings"
        more = f"another setting is less wrong in {_share(1 - confidence)} of draws"
        return f"hardly better than {who}: on the test contacts {more}"
    return f"best, or tied with the best, in {_share(confidence)} of draws of the test contacts"


def late(able: pd.DataFrame, known: Known, budget_ms: float) -> str:
    """Explain why nothing fits a budget."""
    if able.empty:
        return "; ".join(["no setting has answered every sample", *_failed(known.settings)])
    fastest = able.loc[able["online_p95_s"].idxmin()]
    need = f"{(1 - MARGIN) * budget_ms:.3g} ms are what leaves {_share(MARGIN)} of the budget free"
    told = f"the fastest setting, {name(fastest)}, takes {_ms(fastest['online_p95_s'])} at the 95th percentile"
    return "; ".join([f"{told}, and {need}", *_failed(known.settings)])


def under(
    best: pd.Series, rival: pd.Series | None, passed: dict, fits: pd.DataFrame, known: Known, limit: float
) -> str:
    """Explain ``best`` of what stays under an error; passed : fields of an ``Advice`` about what is faster."""
    parts = [
        f"fastest of {counted(fits)} with a mean validation error that stays below {percent(limit)} "
        f"in {_share(RANGE[1])} of draws of the contacts",
        next_best(rival, best, "online_median_s"),
        *passed_over(passed, f"in {_share(RANGE[1])} of draws it is not more"),
    ]
    if best[known.column] > limit:
        parts.insert(0, f"on the test contacts its error is larger than asked, {percent(best[known.column])}")
    return "; ".join([*parts, *_truth(best[known.chosen_by], known), *_failed(known.settings)])


def unknown(able: pd.DataFrame, known: Known) -> str:
    """Explain that no model can be judged by an error as small as was asked for."""
    told = (
        f"the truth is known to {percent(known.own)} only (on the {known.where}), so that no smaller error can be told"
    )
    if able.empty:
        return told
    least = able.loc[able[known.column].idxmin()]
    return f"{told}; the least on test contacts is {percent(least[known.column])}, of {name(least)}"


def wrong(able: pd.DataFrame, highest: pd.Series, known: Known, limit: float) -> str:
    """Explain why nothing stays under an error; highest : what each of ``able`` stays below in 95 % of draws."""
    if able.empty:
        return "; ".join(["no setting has answered every sample", *_failed(known.settings)])
    least = able.loc[highest.idxmin()]
    told = f"the setting of least error, {name(least)}, has a mean error of {percent(least[known.chosen_by])}"
    sure = f"stays below {percent(highest.min())} in {_share(RANGE[1])} of draws of the contacts"
    return "; ".join([f"{told} and {sure}", *_failed(known.settings)])


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


def ratio(rival: pd.Series, best: pd.Series, column: str, floor: float = EXACT) -> float:
    """Return how many times as much the rival has; errors below ``floor`` count as that."""
    least = floor if column.endswith("of_peak") else 0
    return max(rival[column], least) / max(best[column], least)


def behind(factor: float, tie: float, what: str) -> str:
    """Describe how far a rival is behind: "has 4 times the error", or "is equal" within the factor ``tie``."""
    if 1 / tie <= factor <= tie:
        return "is equal within the spread of runs"
    less = " on the test contacts" if factor < 1 and what == "error" else ""
    return f"has {factor:.3g} times the {what}{less}" if factor < 1000 else f"has over 1000 times the {what}"


def next_best(rival: pd.Series | None, best: pd.Series, column: str, floor: float = EXACT) -> str:
    """Name the best of the other models, and how far it is behind in ``column``, an error or a time."""
    if rival is None:
        return "no other model meets the limit"
    tie, what = (EQUAL, "error") if column.endswith("of_peak") else (CLOSE, "time")
    return f"the next best model, {name(rival)}, {behind(ratio(rival, best, column, floor), tie, what)}"


def _truth(error: float, known: Known) -> list[str]:
    """Explain where the truth is not known well enough to tell models apart."""
    if not known.own > EXACT or error >= known.own:
        return []
    own = f"{percent(known.own)}, the truth's own error on the {known.where}"
    return [f"below {own}, models are tied and the fastest is taken"]


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
