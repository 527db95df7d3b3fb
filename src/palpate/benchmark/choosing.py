"""Choose which setting to take under a limit of time, speed or error, by one rule; or none, and the nearest to it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import FEWEST, bound_factor, bounds, finite
from palpate.benchmark.ranking import EQUAL, EXACT, TIED_TIMES, pick
from palpate.number_text import percent_in_table as percent

NONE = "none"
"""The word that stands for a model where none fits."""
MARGIN = 0.2
"""Share of a time that an answer must leave free: it does not repeat to the digit."""
STRICTER = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Shares of a limit that a bound must stay below, in turn until the choice holds at contacts left out of it."""
BOUND = "bound of nine answers in ten"
"""What an error is limited by wherever enough places were asked; other words stand for what takes its place."""
SETTING = ["model", "setting"]
Order = Sequence[tuple[str, float]]
"""What decides, in turn, as ``ranking.pick`` takes it: each column keeps what is within a factor of its least value."""
TIED = 2.0
"""Times of presses within this factor are tied where the fastest is wanted: a busy machine changes ratios by less."""


class Limit(NamedTuple):
    """What is asked for: a time of an answer [ms], an error, a speed of a motion, or the last two; NaN: not limited."""

    budget_ms: float = np.nan
    max_error: float = np.nan
    speed: float = np.nan

    @property
    def time(self) -> str:
        """The time that is allowed, in words; empty where any time is."""
        if np.isfinite(self.speed):
            return f"{self.speed:g} × real time"
        return f"{self.budget_ms:g} ms" if np.isfinite(self.budget_ms) else ""


class HeldOut:
    """Errors of settings at contacts that they have not learnt from.

    errors : (m, n) of m settings at n samples, NaN where a setting was not asked; contact : (n,) of each sample
    bound, mean : (m,) the bound of ``conformal`` and the mean of each setting, infinite where it has no sample
    without : the same two without each contact
    """

    def __init__(self, errors: np.ndarray, contact: np.ndarray):
        self.errors, self.contact = errors, contact
        self.bound, self.mean = self._over(np.ones(len(contact), dtype=bool))
        self.without = {int(place): self._over(contact != place) for place in np.unique(contact)}

    def _over(self, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the bound and the mean of each setting over ``samples`` (n,) bool."""
        errors = np.where(samples, self.errors, np.nan)
        n_samples = np.isfinite(errors).sum(axis=1)
        mean = np.where(n_samples > 0, np.nansum(errors, axis=1) / np.maximum(n_samples, 1), np.inf)
        return bounds(errors, self.contact), mean


def share_below(errors: np.ndarray, contact: np.ndarray, most: float) -> float:
    """Return the share of ``errors`` (n,) that are at most ``most``; each contact (n,) weighs the same."""
    return float(pd.Series(errors <= most).groupby(contact).mean().mean())


@dataclass(frozen=True, eq=False)
class Candidates:
    """The settings of one scene that can be advised, and the rule that chooses one of them.

    rows : a setting each, numbered from 0, with the columns of its table that advice repeats, and
        limit : the error that it is sure to keep, the truth's own in it; infinite where it is sure of none
        mean : its mean error, which must not exceed a largest error either
        basis : what the limit is, in words: BOUND, or what takes its place
        pace : time by which it is called fast [s]; of motions, seconds for a second of motion
        slowest_s : time that a budget is compared with [s]
        doubted : loads that it says it cannot answer
    about : the scene and the kind of error, as columns of advice.csv
    unit : what is answered: a "press", "touch" or "load", or a "step" of a motion, which has to keep up with its time
    own : the truth's own error, below which none is promised; NaN where it is not known
    floor : error below which settings are tied
    compared : the column of the error that decides between settings that answer in time, if any has a limit
    tied : factor within which times are tied where the fastest is wanted
    notes : what else is to be said of every choice
    held : the errors on which a choice is tried at contacts left out of it, of the rows in their order
    """

    rows: pd.DataFrame
    about: dict[str, Any]
    unit: str
    own: float = np.nan
    floor: float = EXACT
    compared: str = "limit"
    tied: float = TIED_TIMES
    notes: Iterable[str] = ()
    held: HeldOut | None = None

    def advise(self, limit: Limit) -> dict[str, Any]:
        """Return what to take under a limit, or none and the nearest to it: columns of advice.csv and of ``rows``."""
        taken, why = ({}, []) if self.rows.empty else self._choose(limit)
        basis = {"reference_error": self.own, "unit": self.unit, "why": "; ".join(filter(None, [*why, *self.notes]))}
        return {"model": NONE} | taken | self.about | limit._asdict() | basis

    def _choose(self, limit: Limit) -> tuple[dict[str, Any], list[str]]:
        """Return what is advised, and the parts of the reason."""
        rows = self.rows.assign(used=self._used(limit))
        timely = rows[rows["used"] <= 1.0 - MARGIN]
        if timely.empty:
            quickest = rows.loc[rows["used"].fillna(np.inf).idxmin()]
            excess = (
                f"{quickest['used'] / (1.0 - MARGIN):.3g} times what leaves {percent(MARGIN)} of {limit.time} unused"
            )
            return _near(quickest), [f"the fastest setting, {_name(quickest)}, takes {excess}"]
        if np.isnan(limit.max_error):
            return self._least_wrong(timely, limit)
        if limit.max_error < self.own:
            why = f"errors are known to {percent(self.own)} only, so that no smaller one can be told"
            return self._nearest(timely, limit.max_error), [why]
        if not limit.time:
            return self._fastest(limit.max_error)
        keeping = _below(timely, limit.max_error)
        if keeping.empty:
            return self._nearest(timely, limit.max_error), [self._why_none(timely)]
        return self._least_wrong(keeping, limit)

    def _used(self, limit: Limit) -> pd.Series | float:
        """Return the share of the time that each setting needs; zero where any time is allowed."""
        if not limit.time:
            return 0.0
        if np.isfinite(limit.speed):
            return limit.speed * self.rows["pace"]
        of_budget = 1e3 * self.rows["slowest_s"] / limit.budget_ms
        return np.maximum(of_budget, self.rows["pace"]) if self.unit == "step" else of_budget

    def _least_wrong(self, rows: pd.DataFrame, limit: Limit) -> tuple[dict[str, Any], list[str]]:
        """Choose the least wrong of ``rows``, which answer in time.

        Ties go to what uses the least of the time, so that a larger one never has a larger error; of motions, to the
        fastest.
        """
        column = self.compared if np.isfinite(rows["limit"]).any() else "mean"
        order = (("doubted", 1.0), (column, EQUAL), ("pace" if self.unit == "step" else "used", 1.0), ("pace", 1.0))
        best = pick(rows, order, self.floor)
        advised = _taken(best, best["limit"]) | self._rival(best, rows, order, column)
        advised["confidence"] = self._stays(best, rows, column)
        advised["margin"] = 1.0 - (best["used"] if np.isnan(limit.max_error) else best["limit"] / limit.max_error)
        error_name = best["basis"] if column == "limit" else "error"
        spare = f" that leave {percent(MARGIN)} of {limit.time} unused" if limit.time else ""
        return advised, [f"least {error_name} of {_counted(rows)}{spare}", *self._hidden(best[column])]

    def _stays(self, best: pd.Series, rows: pd.DataFrame, by: str) -> float:
        """Return the share of contacts without which ``best`` has, or ties with, the least error of ``rows``."""
        if self.held is None:
            return np.nan
        without_each = [
            np.maximum(limit if by == "limit" else mean, self.floor) for limit, mean in self.held.without.values()
        ]
        return float(np.mean([error[best.name] <= EQUAL * error[rows.index].min() for error in without_each]))

    @property
    def _by_time(self) -> Order:
        """What decides, in turn, where the fastest is wanted."""
        return ("doubted", 1.0), ("pace", self.tied), ("limit", EQUAL), ("mean", EQUAL), ("pace", 1.0)

    def _fastest(self, max_error: float) -> tuple[dict[str, Any], list[str]]:
        """Choose the fastest of what stays below an error; none where nobody can promise that.

        Bounds must stay below ever smaller shares of ``max_error``, until the choice keeps it at contacts left out.
        """
        taken, why = self._nearest(self.rows, max_error), self._why_none(self.rows)
        for share in STRICTER if self.held else STRICTER[:1]:
            fits = _below(self.rows, share * max_error)
            if fits.empty:
                break
            best = pick(fits, self._by_time, self.floor)
            bound, keeping = self._left_out(share * max_error, max_error)
            limit = max(bound, best["limit"])
            if limit <= max_error:
                taken = _taken(best, limit) | self._rival(best, fits, self._by_time, "pace")
                taken |= self._passed_over(best, max_error) | {"margin": 1.0 - limit / max_error, "confidence": keeping}
                why = f"fastest of {_counted(fits)} whose {best['basis']} is below {percent(share * max_error)}"
                return taken, [why, *self._hidden(best["limit"])]
            taken = _near(best) | {"nearest_bound": finite(bound), "nearest_risk": 1.0 - keeping, "confidence": keeping}
            lucky = f"{_name(best)} was lucky: where each contact is left out of the choice, only {percent(keeping)}"
            why = f"{lucky} of the answers there stay below {percent(max_error)}"
        return taken, [why]

    def _left_out(self, most: float, max_error: float) -> tuple[float, float]:
        """Choose the fastest below ``most`` anew without each contact, and try each choice at the contact left out.

        Returns the bound of the errors there, and their share below ``max_error``; without any such contact, zero and
        NaN. No contact has a part in the choice that is tried on it, so that being lucky is no part of these errors.
        """
        if self.held is None:
            return 0.0, np.nan
        per_place, contacts_out, rows = [np.empty(0)], [np.empty(0, dtype=int)], self.rows[list(dict(self._by_time))]
        for place, (bound, mean) in self.held.without.items():
            fits = _below(rows.assign(limit=bound, mean=mean), most)
            if len(fits):
                left_out = self.held.errors[pick(fits, self._by_time, self.floor).name, self.held.contact == place]
                per_place.append(left_out[np.isfinite(left_out)])
                contacts_out.append(np.full(len(per_place[-1]), place))
        errors, contact = np.concatenate(per_place), np.concatenate(contacts_out)
        if not len(errors):  # with as few contacts as a bound needs there is none where one is left out
            return 0.0, np.nan
        return bound_factor(errors, contact), share_below(errors, contact, max_error)

    def _rival(self, best: pd.Series, rows: pd.DataFrame, order: Order, by: str) -> dict[str, Any]:
        """Return the first of the other models, and how many times the error or the time of ``best`` it has."""
        others = rows[rows["model"] != best["model"]]
        if others.empty:
            return {}
        rival, floor = pick(others, order, self.floor), 0.0 if by == "pace" else self.floor
        factor = max(rival[by], floor) / max(best[by], floor)
        return {"rival": rival["model"], "rival_setting": rival["setting"], "factor": factor}

    def _passed_over(self, best: pd.Series, max_error: float) -> dict[str, Any]:
        """Return the fastest of what is clearly faster than ``best``, and is below an error in the mean only."""
        rows = self.rows[TIED_TIMES * self.rows["pace"] < best["pace"]]
        rows = rows[(rows["mean"] <= max_error) & ~(rows["limit"] <= max_error)]
        if rows.empty:
            return {}
        fastest = rows.loc[rows["pace"].idxmin()]
        columns = {"faster": fastest["model"], "faster_setting": fastest["setting"], "faster_error": fastest["mean"]}
        return columns | {"faster_high": finite(fastest["limit"]), "faster_factor": best["pace"] / fastest["pace"]}

    def _nearest(self, rows: pd.DataFrame, max_error: float) -> dict[str, Any]:
        """Return which of ``rows`` comes nearest to an error that none is sure to keep, and what it risks."""
        nearest = rows.loc[rows["limit" if np.isfinite(rows["limit"]).any() else "mean"].fillna(np.inf).idxmin()]
        if self.held is None:
            return _near(nearest)
        errors = self.held.errors[nearest.name]
        known = np.isfinite(errors)
        return _near(nearest) | {"nearest_risk": 1.0 - share_below(errors[known], self.held.contact[known], max_error)}

    def _why_none(self, rows: pd.DataFrame) -> str:
        """Explain why none of ``rows`` stays below an error."""
        if np.isfinite(rows["limit"]).any():
            least = rows.loc[rows["limit"].idxmin()]
            return f"the least {least['basis']}, of {_name(least)}, is {percent(least['limit'])}"
        if self.unit == "step":
            return "no setting has a bound, or the own error of what errors are from is not known"
        few = f"no model has more than {rows['contacts'].max():.0f} contacts"
        return f"a bound needs {FEWEST} contacts that a model has not learnt from, and {few}"

    def _hidden(self, error: float) -> list[str]:
        """Say that the truth is not known well enough to tell settings apart that have this error."""
        if error >= self.floor or self.floor <= EXACT:
            return []
        own = percent(self.own)
        return [f"the truth's own error, {own}, is most of it: models are tied there, the fastest is taken"]


def _taken(row: pd.Series, limit: float) -> dict[str, Any]:
    """Return a setting as what is advised; limit : the error that it is sure to keep."""
    return row.to_dict() | {"limit": finite(limit), "bound_of_peak": finite(limit) if row["basis"] == BOUND else np.nan}


def _near(row: pd.Series) -> dict[str, Any]:
    """Return a setting as what comes nearest, and what its error rests on."""
    columns = row[row.index.intersection(["contacts", "presses", "samples", "doubted", "basis", "bound_on"])].to_dict()
    columns |= {"nearest": row["model"], "nearest_setting": row["setting"], "nearest_error": row["mean"]}
    return columns | {"nearest_bound": finite(row["limit"]), "nearest_s": row["slowest_s"]}


def _name(row: pd.Series) -> str:
    """Name model and setting as the tables do."""
    return row["model"] if row["setting"] == "default" else f"{row['model']} {row['setting']}"


def _below(rows: pd.DataFrame, most: float) -> pd.DataFrame:
    """Select what is sure to stay below an error, and does so in the mean."""
    return rows[(rows["limit"] <= most) & (rows["mean"] <= most)]


def _counted(rows: pd.DataFrame) -> str:
    return "one setting" if len(rows) == 1 else f"{len(rows)} settings"
