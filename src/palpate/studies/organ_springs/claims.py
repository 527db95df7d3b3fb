"""Judge paper 2's chain on an organ: whether springs fitted by the genetic algorithm hold at other contacts."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, claims, not_testable, verdict
from palpate.report.tables import where
from palpate.report.words import spaced

HOLDS = 1.5
"""Springs hold at other contacts if their error is less than so many times that at the fitted ones."""
MATTERS = 0.01
"""Masses from a CT matter if uniform ones of the same total change the motion by more than this part of its peak."""


@claims("organ_springs", "organ_history", "mass_motion")
def chain(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on the springs of each organ, and on the masses of those from a CT."""
    for body, rows in tables["organ_springs"].groupby("body", sort=False):
        fitted, tested = (where(rows, used_in_fit=in_fit) for in_fit in (True, False))
        contacts = f"fitted at {fitted['contact'].nunique()} contacts, tested at {tested['contact'].nunique()} others"
        history = where(tables["organ_history"], body=body, model="genetic")
        seeds = history["seed"].nunique()
        search_words = f"{history['generation'].max()} generations, "
        search_words += f"medians of {seeds} seeds" if seeds > 1 else "one seed"
        premise = f"{spaced(str(body))}, {contacts}; springs alone; {search_words}"
        yield _holds(fitted, tested, premise)
        yield _search(tested, premise)
    for body, rows in tables["mass_motion"].groupby("body", sort=False):
        if rows["from_ct"].astype(bool).any():
            yield _masses(rows.set_index("masses"), spaced(str(body)))


def _of_seeds(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the error without volume force, mean over contacts, by seed (rows) and model, at the model's best step."""
    means = where(rows, volume_force=False).groupby(["model", "step_s", "seed"])["rmse_of_peak"].mean()
    return means.groupby(["model", "seed"]).min().unstack("model")


def _over_seeds(means: pd.DataFrame, model: str) -> str:
    """Write the median error of a model and, if it has several seeds, their range."""
    errors = 100 * means[model].dropna()
    span = f" ({errors.min():.2g} to {errors.max():.2g} %)" if len(errors) > 1 else ""
    return f"{errors.median():.2g} %{span}"


def _holds(fitted: pd.DataFrame, tested: pd.DataFrame, premise: str) -> Claim:
    fits, tests = _of_seeds(fitted), _of_seeds(tested)
    ours = f"{_over_seeds(fits, 'genetic')} of the peak where fitted, {_over_seeds(tests, 'genetic')} elsewhere"
    claim = "moduli of an organ found by the genetic algorithm hold for other presses"
    holds = tests["genetic"].median() < HOLDS * fits["genetic"].median()
    return Claim(2, "2, figure 3", claim, premise, "they do, on its cube", ours, verdict(holds))


def _search(rows: pd.DataFrame, premise: str) -> Claim:
    """Judge the genetic algorithm against models that need no search, at contacts that it was not fitted to."""
    means = _of_seeds(rows)
    tested = means.median()
    names = {"genetic": "genetic algorithm", "uniform": "one modulus", "van_gelder": "Van Gelder"}
    ours = ", ".join(f"{words} {_over_seeds(means, name)}" for name, words in names.items())
    claim = "the genetic algorithm is the way to an organ's springs"
    best_rival, seeds = tested[["uniform", "van_gelder"]].min(), means["genetic"].dropna()
    judged = verdict(bool(tested["genetic"] < best_rival))
    if seeds.min() < best_rival <= seeds.max():
        judged = not_testable("some seeds are better than what needs no search, others are not")
    return Claim(2, "3", claim, f"{premise}; at the others", "it is proposed for them", ours, judged)


def _masses(rows: pd.DataFrame, body: str) -> Claim:
    """Judge whether masses from the voxels change the motion by more than MATTERS."""
    evenly, other = rows.loc["mean", "change_of_motion"], rows.loc["uniform", "change_of_motion"]
    ours = (
        f"masses of density_kg_m3 everywhere change motion by {100 * other:.2g} % of the peak, and spread evenly with "
        f"the CT's total by {100 * evenly:.2g} %"
    )
    claim = "node by node, masses from the voxels move an organ otherwise than the same mass spread evenly"
    premise = f"{body}, coarse finite elements; more than {100 * MATTERS:g} % of the peak counts"
    published = "masses are taken from the voxels, and their effect is not measured"
    return Claim(2, "1, equation 4", claim, premise, published, ours, verdict(evenly > MATTERS))
