"""Advise which model to take for a budget of time or an error, say why, and how far splits agree on that."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import (
    BOUNDS,
    CLOSE,
    EQUAL,
    EXACT,
    KINDS,
    RANGE,
    by_error,
    by_time,
    own_errors,
    pick,
    resampled,
)
from palpate.benchmark.conformal import bound_factor, finite
from palpate.errors import InputError
from palpate.table import Table

NONE = "none"
"""The word that stands for a model where none fits."""
MARGIN = 0.2
"""Share of a budget that the 95th percentile of the time must leave free: it repeats less well than the median."""
UNSURE = 0.5
"""Share of draws below which a choice is not called the best: another was, more often than not."""
_SETTING = ["model", "setting"]
ADVICE = Table(
    "advice",
    "The model and setting to take for each limit of time or error, the next best one, and the reason.",
    """
    scene error split: what is asked about: a scene, its "rms" error over the surface or at the "patch" that is pressed,
        and the number of the split (0 where a scene moves and nothing is divided)
    budget_ms max_error: the time of an answer [ms] or the mean error that must not be passed; one of them is empty
    model setting: what to take, or "none"
    rmse_of_peak patch_rms_of_peak: its mean errors over the test samples, which had no part in the choice
    validation_error: the mean that it was chosen by
    error_low error_high: between which the mean error lies in 5 to 95 % of draws of splits and contacts
    bound_of_peak: below which the error of a single answer at another contact stays in nine cases of ten; empty
        where too few contacts are known
    p95_of_peak online_p95_s: 95th percentiles of the error over the nodes, and of the time of an answer
    margin: share of the budget that the time leaves, or of max_error that error_high leaves
    confidence: share of the draws in which it is, or ties with, the least wrong that fits, or stays under max_error
    rival rival_setting factor: the choice without this model, and how many times as wrong, or as slow, it is
    reference_error: of the truth itself, below which models are tied; where a body moves,
        that of the reference's step, which is added to what is compared with max_error
    faster faster_setting faster_error faster_high faster_factor: what is this many times as fast and was passed over,
        the error that it was judged by, and up to where that may be
    speed times_life: seconds of motion in a second, asked for and reached
    bound_on: where a body moves, what the bound was measured on, or why there is none
    why: the reason
    """,
)
AGREEMENT = Table(
    "advice_agreement",
    "How many of the splits advise the same model for each limit.",
    """
    scene body regime error budget_ms max_error: the question
    model setting: what most splits advise, of equally many the first, and its most frequent setting
    splits same same_setting: how many splits there are, advise that model, and advise it with that setting
    others: the other models, with how many splits advise them
    rmse_of_peak patch_rms_of_peak least most: mean errors over the splits that advise it, and the range of the one
        asked about
    """,
    always=False,
)
BY_RADIUS = Table(
    "advice_by_radius",
    "What is advised for fingers of several radii, and where that changes.",
    """
    body error split budget_ms max_error radius_m: the question, for each radius of the finger [m], the smallest first
    model setting rmse_of_peak patch_rms_of_peak: what is advised, and its errors
    flips: whether it is another model than that for the radius before
    """,
    always=False,
)


def advise(
    settings: pd.DataFrame,
    errors: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    kinds: Sequence[str] = tuple(KINDS),
) -> pd.DataFrame:
    """Tabulate advice.csv of one scene: a row for each kind, split, budget [ms] and largest mean error.

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``comparison.read_errors`` gives them
    Settings are chosen by their errors on the validation samples of the split; what is said of them is measured on its
    test samples. A setting that failed on any sample is never advised. Of what fits a budget the least wrong is taken,
    of what stays under an error in 95 % of draws the fastest. Below the truth's own error models are tied, and no
    smaller error is promised. Ties go to the faster, or the less wrong, then to less memory.
    Raises InputError if the two tables do not belong together.
    """
    found: list[dict] = []
    for kind in kinds:
        for _, rows in settings.groupby("split", sort=True):
            asked = _Question(rows.set_index(_SETTING, drop=False), errors, kind)
            found += [asked.within(budget) for budget in budgets_ms]
            found += [asked.under(limit) for limit in max_errors]
    return ADVICE.frame(found)


class _Question:
    """Everything that the answers about one kind of error in one split have in common.

    column, chosen_by : of the errors on test samples, and of those on validation samples
    own : the truth's own error, the larger of that on the test and on the validation samples; NaN where not known
    floor : below which errors cannot be told apart: that, or what nobody could measure
    choosing : the same of the errors that settings are chosen by, on validation samples alone
    where : the samples on which the truth is known less well, in words
    able : the settings that can be advised, by model and setting; highest : what each stays below in 95 % of draws
    """

    def __init__(self, settings: pd.DataFrame, errors: pd.DataFrame, kind: str):
        scene, split = settings["scene"].iloc[0], int(settings["split"].iloc[0])
        self.column, self.chosen_by = KINDS[kind], f"validation_{KINDS[kind]}"
        tests_own, chooses_own = own_errors(settings, self.column)
        self.own = float(np.fmax(tests_own, chooses_own))
        self.floor, self.choosing = (float(np.fmax(EXACT, each)) for each in (self.own, chooses_own))
        self.where = "validation contacts" if chooses_own > tests_own else "test contacts"
        self.none = {"scene": scene, "error": kind, "split": split, "model": NONE, "reference_error": self.own}
        models = settings[~settings["model"].isin(BOUNDS)]
        failed = int((models["failures"] > 0).sum())
        self.failed = [f"settings left out as they failed on some samples: {failed}"] if failed else []
        self.whole = models[models["failures"] == 0]
        self.able = self.whole[self.whole[self.chosen_by].notna()]
        chooses, tests = (errors[errors["side"] == side] for side in ("validation", "test"))
        here = tests[tests["split"] == split]
        _check(scene, self.able, here)
        self.errors = errors[errors["split"] == split].groupby(_SETTING)
        index = self.able.index
        self.means = resampled(tests, self.column).reindex(index).fillna(resampled(here, self.column).reindex(index))
        drawn = resampled(chooses[chooses["split"] == split], self.column).reindex(index)
        self.highest = drawn.quantile(RANGE[1], axis=1).reindex(index)

    def within(self, budget_ms: float) -> dict:
        """Choose the most accurate of what answers in time; a row of ADVICE."""
        none = self.none | {"budget_ms": budget_ms}
        fits = self.able[1e3 * self.able["online_p95_s"] <= (1 - MARGIN) * budget_ms]
        if fits.empty:
            return none | {"why": self._why_late(budget_ms)}
        best, rival = choice(fits, by_error(self.chosen_by), self.choosing)
        least = self.means.loc[fits.index].min().clip(lower=self.floor)
        sure = float((self.means.loc[best.name] <= EQUAL * least).mean())
        found = self._told(best) | versus(best, rival, self.column, self.floor)
        found |= {"margin": 1 - 1e3 * best["online_p95_s"] / budget_ms, "confidence": sure}
        parts = [
            f"least validation error of {counted(fits)} whose 95th percentile leaves {_share(MARGIN)} of "
            f"{budget_ms:g} ms unused",
            _sure(sure, rival),
            next_best(rival, best, self.column, self.floor),
        ]
        late = self.whole[self.whole[self.chosen_by] < best[self.chosen_by]]
        late = late[(1e3 * late["online_p95_s"]).between((1 - MARGIN) * budget_ms, budget_ms)]
        if len(late) and best[self.chosen_by] > self.floor:
            close = late.loc[late[self.chosen_by].idxmin()]
            parts.append(
                f"{name(close)} has a smaller error ({percent(close[self.column])}) "
                f"but too close to the budget ({_ms(close['online_p95_s'])})"
            )
        return none | found | {"why": "; ".join([*parts, *self._tied(best), *self.failed])}

    def under(self, max_error: float) -> dict:
        """Choose the fastest of what is surely accurate enough; none where the truth is not known that well."""
        none = self.none | {"max_error": max_error}
        if max_error < self.own:
            return none | {"why": self._why_unknown()}
        fits = self.able[(self.highest <= max_error).to_numpy()]
        if fits.empty:
            return none | {"why": self._why_wrong()}
        best, rival = choice(fits, by_time(self.chosen_by), self.choosing)
        passed = passed_over(self.able, self.highest, best, "online_median_s", max_error, self.chosen_by)
        found = self._told(best) | versus(best, rival, "online_median_s") | passed
        found |= {"margin": 1 - found["error_high"] / max_error}
        found |= {"confidence": float((self.means.loc[best.name] <= max_error).mean())}
        parts = [
            f"fastest of {counted(fits)} with a mean validation error that stays below {percent(max_error)} "
            f"in {_share(RANGE[1])} of draws of the contacts",
            next_best(rival, best, "online_median_s"),
            *why_passed_over(passed, f"in {_share(RANGE[1])} of draws it is not more"),
        ]
        if best[self.column] > max_error:
            parts.insert(0, f"on the test contacts its error is larger than asked, {percent(best[self.column])}")
        return none | found | {"why": "; ".join([*parts, *self._tied(best), *self.failed])}

    def _told(self, best: pd.Series) -> dict:
        """Return what a row of ADVICE says of its model, whatever was asked."""
        low, high = self.means.loc[best.name].quantile(list(RANGE))
        copied = (*_SETTING, *KINDS.values(), "p95_of_peak", "online_p95_s")
        found = {name: best[name] for name in copied} | {"validation_error": best[self.chosen_by]}
        asked = self.errors.get_group(best.name)
        bound = finite(bound_factor(asked[self.column].to_numpy(), asked["contact"].to_numpy()))
        return found | {"error_low": low, "error_high": high, "bound_of_peak": bound}

    def _why_late(self, budget_ms: float) -> str:
        """Explain why nothing fits a budget."""
        if self.able.empty:
            return "; ".join(["no setting has answered every sample", *self.failed])
        fastest = self.able.loc[self.able["online_p95_s"].idxmin()]
        need = f"{(1 - MARGIN) * budget_ms:.3g} ms are what leaves {_share(MARGIN)} of the budget free"
        told = f"the fastest setting, {name(fastest)}, takes {_ms(fastest['online_p95_s'])} at the 95th percentile"
        return "; ".join([f"{told}, and {need}", *self.failed])

    def _why_unknown(self) -> str:
        """Explain that no model can be judged by an error as small as was asked for."""
        known = f"the truth is known to {percent(self.own)} only (on the {self.where})"
        told = f"{known}, so that no smaller error can be told"
        if self.able.empty:
            return told
        least = self.able.loc[self.able[self.column].idxmin()]
        return f"{told}; the least on test contacts is {percent(least[self.column])}, of {name(least)}"

    def _why_wrong(self) -> str:
        """Explain why nothing stays under an error."""
        if self.able.empty:
            return "; ".join(["no setting has answered every sample", *self.failed])
        least = self.able.loc[self.highest.idxmin()]
        told = f"the setting of least error, {name(least)}, has a mean error of {percent(least[self.chosen_by])}"
        sure = f"stays below {percent(self.highest.min())} in {_share(RANGE[1])} of draws of the contacts"
        return "; ".join([f"{told} and {sure}", *self.failed])

    def _tied(self, best: pd.Series) -> list[str]:
        """Explain where the truth is not known well enough to tell models apart."""
        if not self.own > EXACT or best[self.chosen_by] >= self.own:
            return []
        own = f"{percent(self.own)}, the truth's own error on the {self.where}"
        return [f"below {own}, models are tied and the fastest is taken"]


def _check(scene: str, able: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Raise InputError if a setting stands twice or its samples do not have the mean that its row gives."""
    if able.index.has_duplicates:
        twice = able[able.index.duplicated()].iloc[0]
        raise InputError(f"accuracy_vs_time.csv has {name(twice)} of {scene} twice: give each its own setting")
    found = errors.groupby(_SETTING)["rmse_of_peak"].mean().reindex(able.index)
    if not (right := np.isclose(found, able["rmse_of_peak"], rtol=1e-6, atol=0)).all():
        raise InputError(
            f"accuracy_vs_time.csv and the samples of {name(able[~right].iloc[0])} of {scene} disagree: "
            "make both anew with the workflow"
        )


def choice(fits: pd.DataFrame, by: Mapping[str, float], floor: float = EXACT) -> tuple[pd.Series, pd.Series | None]:
    """Choose the best, and the best of all other models, if there are any; errors below ``floor`` are tied."""
    best = pick(fits, by, floor)
    others = fits[fits["model"] != best["model"]]
    return best, None if others.empty else pick(others, by, floor)


def versus(best: pd.Series, rival: pd.Series | None, column: str, floor: float = EXACT) -> dict:
    """Compare ``rival`` in ``column``, as columns of ADVICE; none where there is no other."""
    if rival is None:
        return {}
    factor = ratio(rival, best, column, floor)
    return {"rival": rival["model"], "rival_setting": rival["setting"], "factor": factor}


def passed_over(
    able: pd.DataFrame, high: pd.Series, best: pd.Series, column: str, max_error: float, error: str = "rmse_of_peak"
) -> dict:
    """Find the fastest of what is clearly faster in ``column`` than ``best``, with an ``error`` below ``max_error``.

    high : up to where the error of each of ``able`` may be. As columns of ADVICE; none where there is none
    """
    passed = able[(able[error] <= max_error) & (CLOSE * able[column] < best[column])]
    if passed.empty:
        return {}
    row = passed.loc[passed[column].idxmin()]
    found = {"faster": row["model"], "faster_setting": row["setting"], "faster_error": row[error]}
    return found | {"faster_high": high[row.name], "faster_factor": best[column] / row[column]}


def _sure(confidence: float, rival: pd.Series | None) -> str:
    """Explain how often a choice is the best of what fits, or that it hardly differs from the others."""
    if confidence < UNSURE:
        who = name(rival) if rival is not None else "its other settings"
        more = f"another setting is less wrong in {_share(1 - confidence)} of draws"
        return f"hardly better than {who}: on the test contacts {more}"
    return f"best, or tied with the best, in {_share(confidence)} of draws of the test contacts"


def why_passed_over(passed: dict, known: str) -> list[str]:
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


def tie_of(column: str) -> tuple[float, str]:
    """Return the factor within which two values of a ``column`` count as equal, and what it has in words."""
    return (EQUAL, "error") if column.endswith("of_peak") else (CLOSE, "time")


def next_best(rival: pd.Series | None, best: pd.Series, column: str, floor: float = EXACT) -> str:
    """Name the best of the other models, and how far it is behind in ``column``, an error or a time."""
    if rival is None:
        return "no other model meets the limit"
    factor, (tie, what) = ratio(rival, best, column, floor), tie_of(column)
    less = " on the test contacts" if factor < 1 and what == "error" else ""
    behind = f"has {factor:.3g} times the {what}{less}" if factor < 1000 else f"has over 1000 times the {what}"
    if 1 / tie <= factor <= tie:
        behind = "is equal within the spread of runs"
    return f"the next best model, {name(rival)}, {behind}"


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


def agreement(advice: pd.DataFrame, scenes: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """Tabulate advice_agreement.csv, a row for each scene, kind of error and question.

    advice : of advice.csv; scenes : body and regime of each scene, others (which move) are left out
    """
    rows = []
    for (scene, kind, budget, limit), asked in _by(
        advice[advice["scene"].isin(scenes)], ["scene", "error", "budget_ms", "max_error"]
    ):
        counts = asked["model"].value_counts(sort=False)
        model = counts.idxmax()
        own = asked[asked["model"] == model]
        settings = own["setting"].fillna("").value_counts(sort=False)
        body, regime = scenes[scene]
        row = {"scene": scene, "body": body, "regime": regime, "error": kind, "budget_ms": budget, "max_error": limit}
        row |= {"model": model, "setting": settings.idxmax(), "splits": len(asked), "same": counts[model]}
        row |= {"same_setting": settings.max(), "least": own[KINDS[kind]].min(), "most": own[KINDS[kind]].max()}
        row |= {"others": ", ".join(f"{name} {count}" for name, count in counts.drop(model).items())}
        rows.append(row | own[list(KINDS.values())].mean().to_dict())
    return AGREEMENT.frame(rows)


def by_radius(advice: pd.DataFrame, radii: Mapping[str, tuple[str, float]]) -> pd.DataFrame:
    """Tabulate advice_by_radius.csv: what is advised for each radius of the finger, the smallest first.

    advice : of advice.csv; radii : body and radius [m] of the scenes that are to be compared, others are left out
    """
    there = advice[advice["scene"].isin(radii)].copy()
    there["body"] = [radii[scene][0] for scene in there["scene"]]
    there["radius_m"] = [radii[scene][1] for scene in there["scene"]]
    found = []
    for _, asked in _by(there, ["body", "error", "split", "budget_ms", "max_error"]):
        rows = asked.sort_values("radius_m", kind="stable")
        before = rows["model"].shift().fillna(rows["model"].iloc[0])
        found.append(rows.assign(flips=rows["model"] != before))
    return pd.concat(found)[BY_RADIUS.columns] if found else BY_RADIUS.frame([])


def _by(advice: pd.DataFrame, columns: list[str]) -> Iterable[tuple[Any, pd.DataFrame]]:
    """Group by ``columns`` in the order of the table; of a budget and a largest error one is empty."""
    return advice.groupby(columns, sort=False, dropna=False)


def same_in(advice: pd.DataFrame) -> tuple[int, int]:
    """Return in how many splits the first row's model is advised, and how many there are, for one question."""
    return int((advice["model"] == advice["model"].iloc[0]).sum()), len(advice)


def agreed(agreement: pd.DataFrame) -> tuple[float, float, int]:
    """Return how often splits agree on a model: the mean share of splits, the share of questions in which all do.

    agreement : of advice_agreement.csv; questions that most splits answer with "none" are left out, as no model is
    advised there, and the number of the others is the third that is returned
    """
    answered = agreement[agreement["model"] != NONE]
    share = answered["same"] / answered["splits"]
    return float(share.mean()), float((share == 1).mean()), len(answered)
