"""Judge paper 2's chain on an organ: whether springs fitted by the genetic algorithm hold at other contacts."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.evaluation.claims import Claim, verdict

TABLES = ("organ_springs", "mass_motion")

HOLDS = 1.5
"""Springs hold at other contacts if their error is less than so many times that at the fitted ones."""
MATTERS = 0.01
"""Masses from a CT matter if uniform ones of the same total change motion by more than this share of the peak."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims, each for every body."""
    for body, rows in tables["organ_springs"].groupby("body", sort=False):
        fitted, tested = (rows[rows["used_in_fit"].astype(bool) == used] for used in (True, False))
        contacts = f"fitted at {fitted['contact'].nunique()} contacts, tested at {tested['contact'].nunique()} others"
        premise = f"{str(body).replace('_', ' ')}, {contacts}; springs alone"
        yield _holds(_mean(fitted), _mean(tested), premise)
        yield _search(_mean(tested), premise)
    for body, rows in tables["mass_motion"].groupby("body", sort=False):
        if rows["from_ct"].astype(bool).any():
            yield _masses(rows.set_index("masses"), str(body).replace("_", " "))


def _mean(rows: pd.DataFrame) -> pd.Series:
    """Return the mean error of each model without volume force, that of its best step."""
    alone = rows[~rows["volume_force"].astype(bool)]
    return alone.groupby(["model", "step_s"])["rmse_of_peak"].mean().groupby("model").min()


def _holds(fitted: pd.Series, tested: pd.Series, premise: str) -> Claim:
    ours = f"{100 * fitted['genetic']:.2g} % of the peak where fitted, {100 * tested['genetic']:.2g} % elsewhere"
    claim = "moduli of an organ found by the genetic algorithm hold for other presses"
    held = tested["genetic"] < HOLDS * fitted["genetic"]
    return Claim(2, "2, figure 3", claim, premise, "they do, on its cube", ours, verdict(held))


def _search(tested: pd.Series, premise: str) -> Claim:
    """Compare with what needs no search: Van Gelder's springs and one modulus for all nodes."""
    names = {"genetic": "genetic algorithm", "uniform": "one modulus", "van_gelder": "Van Gelder"}
    ours = ", ".join(f"{words} {100 * tested[name]:.2g} %" for name, words in names.items())
    claim = "the genetic algorithm is the way to an organ's springs"
    better = tested["genetic"] < tested[["uniform", "van_gelder"]].min()
    return Claim(2, "3", claim, f"{premise}; at the others", "it is proposed for them", ours, verdict(better))


def _masses(rows: pd.DataFrame, body: str) -> Claim:
    change, total = rows.loc["mean", "change_of_motion"], rows.loc["uniform", "change_of_motion"]
    ours = (
        f"masses of density_kg_m3 everywhere change motion by {100 * total:.2g} % of the peak, and spread evenly with "
        f"the CT's total by {100 * change:.2g} %"
    )
    claim = "the masses of nodes have to come from the CT"
    premise = f"{body}, coarse finite elements"
    return Claim(2, "1, equation 4", claim, premise, "they are taken from it", ours, verdict(change > MATTERS))
