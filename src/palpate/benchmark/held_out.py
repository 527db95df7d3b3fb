"""Judge settings at contacts that they have not learnt from, and a choice of them at contacts that it has not seen."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import bound_factor, bounds
from palpate.benchmark.judge import SIDES, TRAINING
from palpate.benchmark.ranking import BOUNDS, averaged, own_errors, same_settings

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
