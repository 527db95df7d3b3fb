"""Advise which model to take for a budget of time or an error, say why, and what that rests on."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import FEWEST, bound_factor, finite
from palpate.benchmark.held_out import SETTING, TIED, HeldOut, fastest, least_wrong
from palpate.benchmark.ranking import (
    BOUNDS,
    EQUAL,
    EXACT,
    KINDS,
    RANGE,
    TIED_TIMES,
    own_error,
    pick,
    resampled,
    unknown,
)
from palpate.errors import InputError
from palpate.table_declaration import Table

NONE = "none"
"""The word that stands for a model where none fits."""
MARGIN = 0.2
"""Share of a budget that the time must leave free: it does not repeat to the digit."""
UNSURE = 0.5
"""Share of the contacts below which a choice is not called the best: without most of them another is."""
STRICTER = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Shares of a limit that a bound must stay below, in turn until the choice holds at contacts left out of it."""
ADVICE = Table(
    "advice",
    "The model and setting to take for each limit of time or error, the next best one, and the reason.",
    """
    scene error: what is asked about: a scene, and its "rms" error over the surface or at the "patch" that is pressed
    budget_ms max_error: the time of an answer [ms], or the error of nine answers in ten, that must not be passed; one
        of them is empty
    over: where a body moves, what of its motion errors are taken over
    model setting: what to take, or "none"
    rmse_of_peak patch_rms_of_peak: its mean errors over the test samples
    error_low error_high: between which the mean error lies in 5 to 95 % of draws of test contacts
    bound_of_peak: below which the error of a single answer at another contact stays in nine cases of ten, with the
        truth's own error: of the setting, or, if that is larger, of what is chosen in the same way without the contact
    contacts presses: how many contacts that it has not learnt from, and presses of them, the bound is of
    rejected rejected_answered: validation and test presses without a truth, of which no error is known, and those of
        them that it answered without a doubt or a failure
    p95_of_peak: 95th percentile of the error over the nodes
    online_median_s online_p95_s online_max_s: times of an answer, or where a body moves of a step: median, 95th
        percentile, and of the slowest press or step
    offline_s memory_mb: of the preparation [s], and what it holds [1e6 bytes]
    margin: share of the budget that the slowest press leaves, or of max_error that the bound leaves
    confidence: where each contact is left out in turn, of a budget the share of contacts without which it is, or ties
        with, the least wrong that fits, of an error the share of the answers there that stay below it
    rival rival_setting factor: the choice without this model, and how many times its bound, or its time, that has
    reference_error: of the truth itself, below which models are tied; where a body moves, that of the standard
        (of its mesh and its step), which is added to what is compared with max_error
    faster faster_setting faster_error faster_high faster_factor: what is this many times as fast and was passed over,
        its mean error, and its bound
    nearest nearest_setting nearest_bound nearest_risk: where there is none, what comes nearest, its bound, and the
        share of its answers that are above max_error
    nearest_error nearest_s: its mean error, the truth's own added, and the time of its slowest press, or where a body
        moves of a step at the 95th percentile [s]
    speed times_life: seconds of motion in a second, asked for and reached
    bound_on: where a body moves, what the bound was measured on, or why there is none
    why: the reason
    """,
)


def advise(
    settings: pd.DataFrame,
    errors: pd.DataFrame,
    budgets_ms: Sequence[float] = (),
    max_errors: Sequence[float] = (),
    kinds: Sequence[str] = tuple(KINDS),
) -> pd.DataFrame:
    """Tabulate advice.csv of one scene: a row for each kind, budget [ms] and largest error of nine answers in ten.

    settings : its rows of accuracy_vs_time.csv; errors : of its samples, as ``comparison.read_errors`` gives them
    Settings are judged at all contacts that they have not learnt from (``HeldOut``), and one that failed on any sample
    is never advised. Of what answers its slowest press within a budget the least bound is taken; of what has a bound
    below an error the fastest, if the answers at each contact, by what is chosen without it, have such a bound too.
    Below the truth's own error models are tied, and no smaller error is promised.
    Raises InputError if the two tables do not belong together.
    """
    _check(settings, errors)
    found: list[dict] = []
    for kind in kinds:
        asked = Question(settings, errors, kind)
        found += [asked.within(budget) for budget in budgets_ms]
        found += [asked.under(limit) for limit in max_errors]
    return ADVICE.frame(found)


class Question:
    """Everything that the answers about one kind of error have in common.

    own : the truth's own error; NaN where not known
    floor : below which bounds cannot be told apart, that of a model that errs everywhere as much as the truth
    able : the settings that can be advised, by model and setting; tests : the errors on test samples
    """

    def __init__(self, settings: pd.DataFrame, errors: pd.DataFrame, kind: str):
        self.column, self.held = KINDS[kind], HeldOut(settings, errors, KINDS[kind])
        self.able = self.held.rows
        self.own = own_error(settings, self.column)
        self.floor = float(np.fmax(EXACT, finite(self.held.own_bound) + self.own))
        self.none = {"scene": settings["scene"].iloc[0], "error": kind, "model": NONE, "reference_error": self.own}
        failed = self.held.failed
        self.failed = [f"settings left out as they failed on some samples: {failed}"] if failed else []
        self.unknown = unknown(errors, self.column)
        self.tests = errors[errors["side"] == "test"]
        names = ("online_median_s", "online_max_s", "bound_of_peak", "mean_of_peak")
        self.median, self.slowest, self.bound, self.mean = (self.able[name].to_numpy() for name in names)
        self.every = np.ones(len(self.able), dtype=bool)

    def within(self, budget_ms: float) -> dict:
        """Choose the most accurate of what answers in time; a row of ADVICE."""
        none = self.none | {"budget_ms": budget_ms}
        fits = 1e3 * self.slowest <= (1 - MARGIN) * budget_ms
        if not fits.any():
            return none | self._late(budget_ms)
        by = "bound_of_peak" if np.isfinite(self.bound[fits]).any() else "mean_of_peak"
        best, rival = self._two(fits, lambda among: least_wrong(among, self.slowest, self.able[by], self.floor))
        sure = self._stays(fits, best, by)
        found = self._of_chosen(best, best["bound_of_peak"]) | versus(best, rival, by, self.floor)
        found |= {"margin": 1 - 1e3 * best["online_max_s"] / budget_ms, "confidence": sure}
        judged = f"bound of nine answers in ten ({_few(best)})" if by == "bound_of_peak" else "mean error"
        parts = [
            f"least {judged} of {counted(self.able[fits])} whose slowest press leaves {_share(MARGIN)} of "
            f"{budget_ms:g} ms unused",
            _sure(sure, rival),
            next_best(rival, best, by, self.floor),
        ]
        late = self.able[~fits & (1e3 * self.median <= budget_ms)]
        late = late[EQUAL * late[by].clip(lower=self.floor) < max(best[by], self.floor)]
        if len(late):
            close = late.loc[late[by].idxmin()]
            parts.append(
                f"{name(close)} has a smaller one ({percent(close[by])}) but takes {_ms(close['online_max_s'])} "
                "for its slowest press"
            )
        return none | found | {"why": self._because(*parts, *self._tied(best[by]))}

    def under(self, max_error: float) -> dict:
        """Choose the fastest of what is accurate enough; none where nobody can promise that."""
        none = self.none | {"max_error": max_error}
        if max_error < self.own:
            return none | self._nearest(max_error) | {"why": self._why_unknown()}
        found: dict = {}
        for share in STRICTER:
            most = share * max_error
            best, rival = self._two(self.every, partial(self._fastest, most, self.bound, self.mean))
            if best is None:
                break
            errors, contact = self.held.left_out(partial(self._fastest, most, among=self.every))
            # with as few contacts as a bound needs there is none where one is left out, and nothing can be tried
            after, sure = 0.0, np.nan
            if len(errors):
                after, sure = bound_factor(errors, contact), _kept(errors, contact, max_error)
            if after <= max_error:
                return none | self._under(max_error, most, best, rival, max(after, best["bound_of_peak"]), sure)
            why = self._because(self._why_lucky(best, sure, max_error))
            found = _near(best, after, 1 - sure) | {"confidence": sure, "why": why}
        return none | (found or self._nearest(max_error) | {"why": self._why_wrong()})

    def _fastest(self, most: float, bound: np.ndarray, mean: np.ndarray, among: np.ndarray) -> int | None:
        return fastest(among & (bound <= most) & (mean <= most), self.median, bound, mean, self.floor)

    def _under(self, max_error: float, most: float, best: pd.Series, rival: Any, bound: float, sure: float) -> dict:
        """Return what a row of ADVICE says of what is chosen for an error; ``most``: what bounds had to stay below."""
        passed, why_passed = passed_over(self.able, best, max_error)
        found = self._of_chosen(best, bound) | versus(best, rival, "online_median_s") | passed
        found |= {"margin": 1 - bound / max_error, "confidence": sure}
        fits = self.able[(self.bound <= most) & (self.mean <= most)]
        parts = [
            f"fastest, within a factor of {TIED:g}, of {counted(fits)} of which nine answers in ten stay below "
            f"{percent(most)} ({_few(best)})"
        ]
        if np.isfinite(sure):
            kept = f"{_share(sure)} of the answers there stay below {percent(max_error)}"
            parts.append(f"where each contact is left out of the choice, {kept}")
        parts += [next_best(rival, best, "online_median_s"), *why_passed]
        if best[self.column] > max_error:
            parts.insert(0, f"on the test contacts its error is larger than asked, {percent(best[self.column])}")
        return found | {"why": self._because(*parts, *self._tied(best["bound_of_peak"]))}

    def _because(self, *parts: str) -> str:
        """Join the parts of a reason, after what its errors are where they are not distances from a truth."""
        return "; ".join([*filter(None, [self.unknown]), *parts, *self.failed])

    def _stays(self, fits: np.ndarray, best: pd.Series, by: str) -> float:
        """Return the share of contacts without which ``best`` has, or ties with, the least error of what ``fits``."""
        place, kept = self.able.index.get_loc(best.name), []
        for bound, mean in self.held.without.values():
            values = np.maximum(bound if by == "bound_of_peak" else mean, self.floor)
            kept.append(values[place] <= EQUAL * values[fits].min())
        return float(np.mean(kept))

    def _two(self, fits: np.ndarray, choose: Any) -> tuple[Any, Any]:
        """Return what is chosen of what ``fits`` (m,), and the best of the other models; None where there is none."""
        chosen = choose(fits)
        if chosen is None:
            return None, None
        best = self.able.iloc[chosen]
        other = choose(fits & (self.able["model"] != best["model"]).to_numpy())
        return best, None if other is None else self.able.iloc[other]

    def _of_chosen(self, best: pd.Series, bound: float) -> dict:
        """Return what a row of ADVICE has of the model that it chose, whatever was asked."""
        mine = self.tests[(self.tests["model"] == best["model"]) & (self.tests["setting"] == best["setting"])]
        low, high = resampled(mine, self.column).iloc[0].quantile(list(RANGE))
        copied = (
            *SETTING, *KINDS.values(), "p95_of_peak", "online_median_s", "online_p95_s", "online_max_s", "offline_s",
            "memory_mb", "contacts", "presses", "rejected", "rejected_answered",
        )  # fmt: skip
        found = {name: best[name] for name in copied}
        return found | {"error_low": low, "error_high": high, "bound_of_peak": finite(bound)}

    def _nearest(self, max_error: float) -> dict:
        """Return what comes nearest to an error that nothing is sure to keep, and what it risks."""
        if self.able.empty:
            return {}
        place = int(np.argmin(self.bound if np.isfinite(self.bound).any() else self.mean))
        best, errors = self.able.iloc[place], self.held.errors[place]
        known = np.isfinite(errors)
        risk = 1.0 - _kept(errors[known], self.held.contact[known], max_error)
        return _near(best, best["bound_of_peak"], risk)

    def _late(self, budget_ms: float) -> dict:
        """Return what comes nearest to a budget that nothing fits, and explain that."""
        if self.able.empty:
            return {"why": "; ".join(["no setting has answered every sample", *self.failed])}
        quickest, most = self.able.loc[self.able["online_max_s"].idxmin()], (1 - MARGIN) * budget_ms
        told = f"the fastest setting, {name(quickest)}, takes {_ms(quickest['online_max_s'])} for its slowest press"
        need = f"{1e3 * quickest['online_max_s'] / most:.3g} times the {most:.3g} ms that leave {_share(MARGIN)} unused"
        return _near(quickest, quickest["bound_of_peak"], np.nan) | {"why": self._because(f"{told}, {need}")}

    def _why_unknown(self) -> str:
        """Explain that no model can be judged by an error as small as was asked for."""
        told = f"the truth is known to {percent(self.own)} only, so that no smaller error can be told"
        if self.able.empty:
            return told
        least = self.able.loc[self.able[self.column].idxmin()]
        return f"{told}; the least on test contacts is {percent(least[self.column])}, of {name(least)}"

    def _why_lucky(self, best: pd.Series, sure: float, max_error: float) -> str:
        """Explain that what has a bound below an error has it because it was chosen for that."""
        told = f"{name(best)} has a bound of {percent(best['bound_of_peak'])} ({_few(best)})"
        kept = f"only {_share(sure)} of the answers there stay below {percent(max_error)}"
        return f"{told}, but where each contact is left out of the choice {kept}"

    def _why_wrong(self) -> str:
        """Explain why nothing stays under an error."""
        if self.able.empty:
            return "; ".join(["no setting has answered every sample", *self.failed])
        least = self.able.loc[self.able["bound_of_peak"].idxmin()]
        if not np.isfinite(least["bound_of_peak"]):
            most = self.able.loc[self.able["contacts"].idxmax()]
            needed = f"a bound needs {FEWEST} contacts that a model has not learnt from"
            return f"{needed}, and no model has more than {most['contacts']} contacts ({most['presses']} presses there)"
        told = f"nine answers in ten of the setting of least bound, {name(least)}, have an error of less than"
        return self._because(f"{told} {percent(least['bound_of_peak'])} ({_few(least)})")

    def _tied(self, bound: float) -> list[str]:
        """Explain where the truth is not known well enough to tell models apart."""
        if not self.own > EXACT or bound >= self.floor:
            return []
        return [
            f"the truth's own error, {percent(self.own)}, is most of it: models are tied there, the fastest is taken"
        ]


def _near(best: pd.Series, bound: float, risk: float) -> dict:
    """Return the columns of ADVICE about what comes nearest."""
    found = {"nearest": best["model"], "nearest_setting": best["setting"], "nearest_risk": risk}
    found |= {"nearest_bound": finite(bound), "nearest_error": best["mean_of_peak"], "nearest_s": best["online_max_s"]}
    return found | {"contacts": best["contacts"], "presses": best["presses"]}


def _kept(errors: np.ndarray, contact: np.ndarray, most: float) -> float:
    """Return the share of ``errors`` (n,) that are not above ``most``; each contact weighs the same."""
    return float(pd.Series(errors <= most).groupby(contact).mean().mean())


def _few(best: pd.Series) -> str:
    return f"{best['contacts']} contacts, {best['presses']} presses"


def _check(settings: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Raise InputError if a setting stands twice or its samples do not have the mean that its row gives."""
    place = ["split", *SETTING]
    able = settings[~settings["model"].isin(BOUNDS) & (settings["failures"] == 0)].set_index(place, drop=False)
    scene = settings["scene"].iloc[0]
    if able.index.has_duplicates:
        twice = able[able.index.duplicated()].iloc[0]
        raise InputError(f"accuracy_vs_time.csv has {name(twice)} of {scene} twice: give each its own setting")
    found = errors[errors["side"] == "test"].groupby(place)["rmse_of_peak"].mean().reindex(able.index)
    if not (right := np.isclose(found, able["rmse_of_peak"], rtol=1e-6, atol=0)).all():
        raise InputError(
            f"accuracy_vs_time.csv and the samples of {name(able[~right].iloc[0])} of {scene} disagree: "
            "make both anew with the workflow"
        )


def choice(fits: pd.DataFrame, by: Mapping[str, float]) -> tuple[pd.Series, pd.Series | None]:
    """Choose the best by ``pick``, and the best of all other models, if there are any."""
    best = pick(fits, by)
    others = fits[fits["model"] != best["model"]]
    return best, None if others.empty else pick(others, by)


def versus(best: pd.Series, rival: pd.Series | None, column: str, floor: float = EXACT) -> dict:
    """Compare ``rival`` in ``column``, as columns of ADVICE; none where there is no other."""
    if rival is None:
        return {}
    factor = ratio(rival, best, column, floor)
    return {"rival": rival["model"], "rival_setting": rival["setting"], "factor": factor}


def passed_over(able: pd.DataFrame, best: pd.Series, max_error: float) -> tuple[dict, list[str]]:
    """Find the fastest of what is clearly faster than ``best`` and has a mean error, but no bound, below ``max_error``.

    Returns columns of ADVICE and why it was passed over; both are empty where there is none.
    """
    column = "online_median_s"
    passed = able[(able["mean_of_peak"] <= max_error) & (able["bound_of_peak"] > max_error)]
    passed = passed[TIED_TIMES * passed[column] < best[column]]
    if passed.empty:
        return {}, []
    row = passed.loc[passed[column].idxmin()]
    mean, high, factor = row["mean_of_peak"], finite(row["bound_of_peak"]), best[column] / row[column]
    found = {"faster": row["model"], "faster_setting": row["setting"], "faster_error": mean}
    risk = f"one answer in ten may have more than {percent(high)}" if np.isfinite(high) else "its bound is not known"
    said = (
        f"{name(row)} is {factor:.2g} times as fast and was passed over: its mean error is {percent(mean)}, and {risk}"
    )
    return found | {"faster_high": high, "faster_factor": factor}, [said]


def _sure(confidence: float, rival: pd.Series | None) -> str:
    """Explain how often a choice is the best of what fits, or that it hardly differs from the others."""
    if confidence < UNSURE:
        who = name(rival) if rival is not None else "its other settings"
        return (
            f"hardly better than {who}: another has a smaller error without one of the contacts in "
            f"{_share(1 - confidence)}"
        )
    return f"best, or tied with the best, without any one contact in {_share(confidence)} of cases"


def name(setting: pd.Series) -> str:
    """Name model and setting as the tables do."""
    return setting["model"] if setting["setting"] == "default" else f"{setting['model']} {setting['setting']}"


def ratio(rival: pd.Series, best: pd.Series, column: str, floor: float = EXACT) -> float:
    """Return how many times as much the rival has; errors below ``floor`` count as that."""
    least = floor if column.endswith("of_peak") else 0
    return max(rival[column], least) / max(best[column], least)


def tie_of(column: str) -> tuple[float, str]:
    """Return the factor within which two values of a ``column`` count as equal, and what it has in words."""
    if column == "bound_of_peak":
        return EQUAL, "bound"
    return (EQUAL, "error") if column.endswith("of_peak") else (TIED_TIMES, "time")


def next_best(rival: pd.Series | None, best: pd.Series, column: str, floor: float = EXACT) -> str:
    """Name the best of the other models, and how far it is behind in ``column``, an error or a time."""
    if rival is None:
        return "no other model meets the limit"
    factor, (tie, what) = ratio(rival, best, column, floor), tie_of(column)
    behind = f"has {factor:.3g} times the {what}" if factor < 1000 else f"has over 1000 times the {what}"
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
