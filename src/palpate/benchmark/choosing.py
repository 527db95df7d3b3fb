"""Choose by one rule which setting to take: within a time, at a speed or below an error; or none, and the nearest."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import FEWEST, bound_factor, bounds, finite
from palpate.benchmark.judge import SIDES, TRAINING
from palpate.benchmark.ranking import (
    ALIKE,
    BOUNDS,
    EQUAL,
    EXACT,
    TIED_TIMES,
    averaged,
    first_of,
    own_errors,
    same_settings,
)
from palpate.number_text import percent_in_table as percent

NONE = "none"
"""The word that stands for a model where none fits."""
MARGIN = 0.2
"""Share of a time that an answer must leave free: it does not repeat to the digit."""
STRICTER = (1.0, 0.8, 0.6, 0.4, 0.2)
"""Shares of a limit that a bound must stay below, in turn until the choice holds at contacts left out of it."""
BOUND = "bound of nine answers in ten"
"""What an error is limited by wherever enough places were asked; other words stand for what takes its place."""
LEAST_WRONG = (("limit", EQUAL), ("pace", TIED_TIMES), ("memory_mb", ALIKE))
"""What decides, in turn, where the least error is wanted: each column keeps what is within a factor of its least."""
FASTEST = (("pace", TIED_TIMES), ("limit", EQUAL), ("memory_mb", ALIKE))
"""What decides, in turn, where the fastest is wanted."""

Order = Sequence[tuple[str, float]]


class Limit(NamedTuple):
    """What is asked for: a time of an answer [ms], an error, a speed of a motion, or the last two; NaN: not limited."""

    budget_ms: float = np.nan
    max_error: float = np.nan
    speed: float = np.nan

    @property
    def words(self) -> str:
        """What an answer has to be in time for."""
        return f"{self.speed:g} × real time" if np.isfinite(self.speed) else f"{self.budget_ms:g} ms"


SETTING = ["model", "setting"]
TIED = 2.0
"""Times within this factor are tied where the fastest is wanted: wider than what a busy machine does to their ratio."""
_FIRST = {side: i for i, side in enumerate((*SIDES[::-1], TRAINING))}


class HeldOut:
    """The errors of one kind of the m settings of a scene that answered all n samples that they were asked.

    rows : the settings, by model and setting, means over the splits, with bound_of_peak, mean_of_peak, contacts,
        presses : the bound that nine answers in ten at a new contact stay below (``conformal``), the mean, and how
        many contacts and presses these are of
    errors : (m, n) [of the peak], NaN where a setting was not asked; contact, sample : (n,)
    own : (n,) the truth's own error, as ``own_errors``, or zero where none is known; own_bound : what nine in ten of
        these stay below
    without : by contact, the bounds (m,) and the means (m,) that are found without it

    A contact is asked in the split that tests on it, else where it chooses settings; of settings that learn nothing
    there may be answers at training contacts too. The truth's own error is added to each error: distances obey the
    triangle inequality, so the sum bounds the distance from the exact answer. A root of squares would take the two as
    independent, and models that extrapolate from the levels of the truth err as it does.
    """

    def __init__(self, settings: pd.DataFrame, errors: pd.DataFrame, column: str):
        wide, whole = _wide(settings, errors, column), averaged(settings)
        self.contact, self.sample = (wide.columns.get_level_values(name).to_numpy() for name in ("contact", "sample"))
        self.own = np.nan_to_num(own_errors(errors, column, self.sample))
        self.own_bound = bound_factor(self.own, self.contact)
        whole = whole[~whole["model"].isin(BOUNDS)].set_index(SETTING, drop=False)
        self.failed = int((~whole.index.isin(wide.index)).sum())
        wide = wide.reindex(whole.index[whole.index.isin(wide.index)])
        self.errors = wide.to_numpy() + self.own
        bound, mean = self._of(np.ones(len(self.contact), dtype=bool))
        asked = np.isfinite(self.errors)
        contacts = [len(np.unique(self.contact[known])) for known in asked]
        self.rows = whole.loc[wide.index].assign(
            bound_of_peak=bound, mean_of_peak=mean, contacts=contacts, presses=asked.sum(axis=1)
        )
        self.without = {int(place): self._of(self.contact != place) for place in np.unique(self.contact)}

    def _of(self, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the bound and the mean of each setting over ``samples`` (n,) bool; infinite of none."""
        there = np.where(samples, self.errors, np.nan)
        count = np.isfinite(there).sum(axis=1)
        mean = np.where(count > 0, np.nansum(there, axis=1) / np.maximum(count, 1), np.inf)
        return bounds(there, self.contact), mean

    def left_out(self, choose: Callable[[np.ndarray, np.ndarray], int | None]) -> tuple[np.ndarray, np.ndarray]:
        """Choose anew without each contact; return the errors (k,) there of what is chosen, and their contacts (k,).

        choose : of the bounds (m,) and means (m,) of all settings the place of one, or None
        No contact has a part in the choice that is tried on it, so that being lucky is no part of these errors.
        """
        errors, contact = [np.empty(0)], [np.empty(0, dtype=int)]
        for place, found in self.without.items():
            if (chosen := choose(*found)) is not None:
                there = self.errors[chosen, self.contact == place]
                errors.append(there[np.isfinite(there)])
                contact.append(np.full(len(errors[-1]), place))
        return np.concatenate(errors), np.concatenate(contact)


def _wide(settings: pd.DataFrame, errors: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return a row for each setting without failures, as ``averaged`` names it, and a column (contact, sample) each."""
    place = ["split", *SETTING]
    named = settings[place].assign(key=same_settings(settings))
    named = named.assign(first=named.groupby(["model", "key"], sort=False)["setting"].transform("first"))
    found = errors.merge(named, on=place).sort_values("side", key=lambda sides: sides.map(_FIRST), kind="stable")
    found["setting"] = found["first"]
    failed = found[column].isna().groupby([found[name] for name in SETTING]).any()
    wide = found.drop_duplicates([*SETTING, "sample"]).pivot(
        index=SETTING, columns=["contact", "sample"], values=column
    )
    return wide.loc[wide.index.isin(failed.index[~failed])]


class Candidates:
    """The m settings of a scene that can be advised, and the rule that chooses one of them.

    rows : with model, setting and
        limit : what stays below an error if the setting does, the truth's own error in it; infinite where nothing does
        mean : its mean error, which judges where nothing has a limit
        basis : what the limit is, in words: BOUND, or what takes its place
        pace : time by which it is called fast [s]; of motions, seconds for a second of motion
        slowest_s : time that a budget is compared with
        doubted : loads that it says it cannot answer, ``contacts`` : places that it has answered
    own : the truth's own error, below which none is promised; NaN where not known
    floor : error below which settings are tied
    order : what decides where the least error is wanted, and where the fastest is
    unit : what an answer is to; moves : whether it is a step of a motion, which has to keep up with its time
    notes : what else is to be said of every choice
    held : what tries a choice at contacts left out of it
    """

    def __init__(
        self,
        rows: pd.DataFrame,
        own: float = np.nan,
        floor: float = EXACT,
        order: tuple[Order, Order] = (LEAST_WRONG, FASTEST),
        unit: str = "press",
        moves: bool = False,
        notes: Iterable[str] = (),
        held: HeldOut | None = None,
    ):
        self.rows, self.own, self.floor, self.unit, self.moves, self.held = rows, own, floor, unit, moves, held
        (self.least_wrong, self.fastest), self.notes = order, [note for note in notes if note]
        names = {"limit", "mean", "pace", "slowest_s", *(name for each in order for name, _ in each)}
        known = rows.reindex(columns=list(names)).astype(float).fillna(np.inf)  # nobody knows the memory of a motion
        self.columns = {name: known[name].to_numpy() for name in names}

    def advise(self, limit: Limit) -> dict:
        """Return what to take under a limit, or none and the nearest: columns of ``advice.ADVICE``."""
        if self.rows.empty:
            return self._because()
        if np.isfinite(limit.max_error) and np.isnan(limit.speed):
            return self._under(limit.max_error)
        return self._within(limit)

    def _within(self, limit: Limit) -> dict:
        """Choose the least wrong of what answers in time, a MARGIN to spare."""
        used = self._used(limit)
        fits = used <= 1.0 - MARGIN
        if not fits.any():
            quickest = int(np.argmin(used))
            times = f"{used[quickest] / (1.0 - MARGIN):.3g} times what leaves {percent(MARGIN)} of {limit.words} unused"
            return self._near(quickest) | self._because(f"the fastest setting, {self.name(quickest)}, takes {times}")
        sure = fits & self._keeps(limit.max_error, self.columns) if np.isfinite(limit.max_error) else fits
        order: Order = self.least_wrong
        if not np.isfinite(self.columns["limit"][fits]).any():
            order = [("mean" if name == "limit" else name, factor) for name, factor in order]
        if not sure.any():
            best = self._first(fits, order)
            why = f"the least wrong at this speed, {self.name(best)}, may have more than {percent(limit.max_error)}"
            return self._near(best) | self._because(why)
        best, by = self._first(sure, order), order[0][0]
        margin = 1.0 - used[best]
        if np.isfinite(limit.max_error):
            margin = 1.0 - self.rows["limit"].iloc[best] / limit.max_error
        what = self.rows["basis"].iloc[best] if by == "limit" else "error"
        asked = f" that leave {percent(MARGIN)} of {limit.words} unused" if used.any() else ""
        found = self._taken(best, sure, order) | {"margin": margin, "confidence": self._stays(sure, best, by)}
        return found | self._because(f"least {what} of {counted(sure)}{asked}", *self._tied(best, by))

    def _under(self, max_error: float) -> dict:
        """Choose the fastest of what stays below an error; none where nobody can promise that.

        Limits are ever stricter, until the choice that they make keeps ``max_error`` at contacts left out of it, too.
        """
        if max_error < self.own:
            why = f"errors are known to {percent(self.own)} only, so that no smaller one can be told"
            return self._nearest(max_error) | self._because(why)
        found: dict = {}
        for share in STRICTER if self.held else STRICTER[:1]:
            most = share * max_error
            fits = self._keeps(most, self.columns)
            if not fits.any():
                break
            best = self._first(fits, self.fastest)
            bound, sure = self._bound_left_out(most, max_error)
            limit = max(bound, self.rows["limit"].iloc[best])
            if limit <= max_error:
                found = self._taken(best, fits, self.fastest, limit) | self._passed_over(best, max_error)
                found |= {"margin": 1.0 - limit / max_error, "confidence": sure}
                what = f"{self.rows['basis'].iloc[best]} is below {percent(most)}"
                return found | self._because(f"fastest of {counted(fits)} whose {what}", *self._tied(best, "limit"))
            why = f"{self.name(best)} was lucky: where each contact is left out of the choice, only {percent(sure)}"
            found = self._near(best, bound, 1.0 - sure) | {"confidence": sure}
            found |= self._because(f"{why} of the answers there stay below {percent(max_error)}")
        return found or self._nearest(max_error) | self._because(self._why_none())

    def _used(self, limit: Limit) -> np.ndarray:
        """Return the share (m,) of the time that each setting needs; zero where none is limited."""
        if np.isfinite(limit.speed):
            return limit.speed * self.columns["pace"]
        if np.isnan(limit.budget_ms):
            return np.zeros(len(self.rows))
        late = 1e3 * self.columns["slowest_s"] / limit.budget_ms
        return np.maximum(late, self.columns["pace"]) if self.moves else late

    def _keeps(self, most: float, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        return (columns["limit"] <= most) & (columns["mean"] <= most)

    def _first(self, fits: np.ndarray, order: Order, columns: Mapping[str, np.ndarray] | None = None) -> int:
        """Return the first of what ``fits`` (m,), which is something, by ``order``, of what doubts the fewest loads."""
        doubted = self.rows["doubted"].to_numpy()
        fits = fits & (doubted == doubted[fits].min())
        return int(first_of(fits, *((self._values(name, columns), factor) for name, factor in order)) or 0)

    def _values(self, name: str, columns: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
        """Return a column (m,), errors below the floor raised to it."""
        values = (columns or self.columns)[name]
        return np.maximum(values, self.floor) if name in ("limit", "mean", "own_path") else values

    def _bound_left_out(self, most: float, max_error: float) -> tuple[float, float]:
        """Return the bound at contacts each left out of the choice, and the share of answers there below an error.

        Without any such contact, zero and NaN.
        """
        if self.held is None:
            return 0.0, np.nan

        def anew(limit: np.ndarray, mean: np.ndarray) -> int | None:
            columns = self.columns | {"limit": limit, "mean": mean}
            fits = self._keeps(most, columns)
            return self._first(fits, self.fastest, columns) if fits.any() else None

        errors, contact = self.held.left_out(anew)
        # with as few contacts as a bound needs there is none where one is left out, and nothing can be tried
        return (bound_factor(errors, contact), kept(errors, contact, max_error)) if len(errors) else (0.0, np.nan)

    def _stays(self, fits: np.ndarray, best: int, by: str) -> float:
        """Return the share of contacts without which ``best`` has, or ties with, the least error of what ``fits``."""
        if self.held is None:
            return np.nan
        found = [np.maximum(limit if by == "limit" else mean, self.floor) for limit, mean in self.held.without.values()]
        return float(np.mean([values[best] <= EQUAL * values[fits].min() for values in found]))

    def _taken(self, best: int, fits: np.ndarray, order: Order, limit: float | None = None) -> dict:
        """Return what is advised, and the best of the other models; limit : of the choice, if not the setting's own."""
        row = self.rows.iloc[best]
        limit = finite(row["limit"] if limit is None else limit)
        found = row.to_dict() | {"limit": limit, "bound_of_peak": limit if row["basis"] == BOUND else np.nan}
        others, by = fits & (self.rows["model"] != row["model"]).to_numpy(), order[0][0]
        if not others.any():
            return found
        rival = self._first(others, order)
        other = self.rows.iloc[rival]
        factor = self._values(by)[rival] / self._values(by)[best]
        return found | {"rival": other["model"], "rival_setting": other["setting"], "factor": factor}

    def _passed_over(self, best: int, max_error: float) -> dict:
        """Return the fastest of what is clearly faster than ``best``, and is below an error in the mean only."""
        pace, limit, mean = (self.columns[name] for name in ("pace", "limit", "mean"))
        passed = (mean <= max_error) & (limit > max_error) & (TIED_TIMES * pace < pace[best])
        if not passed.any():
            return {}
        place = int(np.argmin(np.where(passed, pace, np.inf)))
        row = self.rows.iloc[place]
        found = {"faster": row["model"], "faster_setting": row["setting"], "faster_error": row["mean"]}
        return found | {"faster_high": finite(row["limit"]), "faster_factor": pace[best] / pace[place]}

    def _near(self, place: int, limit: float | None = None, risk: float = np.nan) -> dict:
        """Return what comes nearest."""
        row = self.rows.iloc[place]
        rests_on = ("contacts", "presses", "samples", "doubted", "basis", "bound_on")
        found = {name: row.get(name, np.nan) for name in rests_on}
        found |= {"nearest": row["model"], "nearest_setting": row["setting"], "nearest_error": row["mean"]}
        limit = finite(row["limit"]) if limit is None else finite(limit)
        return found | {"nearest_bound": limit, "nearest_s": row["slowest_s"], "nearest_risk": risk}

    def _nearest(self, max_error: float) -> dict:
        """Return what comes nearest to an error that nothing is sure to keep, and what it risks."""
        by = "limit" if np.isfinite(self.columns["limit"]).any() else "mean"
        place, risk = int(np.argmin(self.rows[by].fillna(np.inf))), np.nan
        if self.held is not None:
            errors = self.held.errors[place]
            known = np.isfinite(errors)
            risk = 1.0 - kept(errors[known], self.held.contact[known], max_error)
        return self._near(place, risk=risk)

    def _why_none(self) -> str:
        """Explain why nothing stays below an error."""
        if not np.isfinite(self.columns["limit"]).any():
            if self.moves:
                return "no setting has a bound, or the own error of what errors are from is not known"
            few = f"no model has more than {self.rows['contacts'].max():.0f} contacts"
            return f"a bound needs {FEWEST} contacts that a model has not learnt from, and {few}"
        place = int(np.argmin(self.columns["limit"]))
        row = self.rows.iloc[place]
        return f"the least {row['basis']}, of {self.name(place)}, is {percent(row['limit'])}"

    def _tied(self, best: int, by: str) -> list[str]:
        """Explain where the truth is not known well enough to tell settings apart."""
        if not self.own > EXACT or self.floor <= EXACT or self.rows[by].iloc[best] >= self.floor:
            return []
        return [
            f"the truth's own error, {percent(self.own)}, is most of it: models are tied there, the fastest is taken"
        ]

    def _because(self, *parts: str) -> dict:
        return {"why": "; ".join([*parts, *self.notes])}

    def name(self, place: int) -> str:
        """Name model and setting as the tables do."""
        model, setting = self.rows[["model", "setting"]].iloc[place]
        return model if setting == "default" else f"{model} {setting}"


def kept(errors: np.ndarray, contact: np.ndarray, most: float) -> float:
    """Return the share of ``errors`` (n,) that are not above ``most``; each contact weighs the same."""
    return float(pd.Series(errors <= most).groupby(contact).mean().mean())


def counted(fits: np.ndarray) -> str:
    """Return how many settings fit (m,), in words."""
    return "one setting" if fits.sum() == 1 else f"{fits.sum()} settings"
