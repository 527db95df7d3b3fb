"""Judge the paper's claims: each is confirmed or refuted by this run's numbers."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

CLEARLY = 0.8
"""One error is clearly below another if under this fraction of it, and on a par if neither is."""
ORDER_MARGIN = 0.25
"""A measured exponent agrees with the paper's order within this much, or within its confidence interval."""
READINGS = ("nonnegative_a", "nonnegative_b")


class Claim(NamedTuple):
    """One row of claims.csv."""

    claim: str
    paper: str
    measured: str
    verdict: str


def claims(
    accuracy: pd.DataFrame,
    sweep: pd.DataFrame,
    complexity: pd.DataFrame,
    timing: pd.DataFrame,
    paper: Mapping,
) -> pd.DataFrame:
    """Tabulate claims.csv from the other tables; only bodies that the paper has are looked at.

    paper : its numbers, as in workflow/report/enrichment/published.yaml
    """
    terms = {"protocol": "paper", "split": "samples"}
    found = [
        *_feature_claims(_where(accuracy, **terms), paper["features"]),
        *_sigma_claims(_where(sweep, **terms), paper["sigma"]),
        *_order_claims(complexity),
        *_ratio_claims(timing, paper["means"]),
    ]
    return pd.DataFrame(found, columns=Claim._fields)


def _feature_claims(accuracy: pd.DataFrame, said: Mapping[str, str]) -> list[Claim]:
    found = []
    for (body, regime), table in accuracy.groupby(["body", "regime"], sort=False):
        if body not in said:
            continue
        error = table.set_index("method")["rmse_of_peak"]
        ratios = {kind: error[f"ordered_{kind}"] / error[f"unordered_{kind}"] for kind in READINGS}
        measured = "; ".join(
            f"{kind}: {error[f'ordered_{kind}']:.3g} of peak against {error[f'unordered_{kind}']:.3g}"
            for kind in READINGS
        )
        if said[body] == "clearly better":
            holds = min(ratios.values()) < CLEARLY
        else:
            holds = any(CLEARLY <= ratio <= 1 / CLEARLY for ratio in ratios.values())
        claim = f"contact-ordered against unordered features: {said[body]} ({body}, {regime} loads)"
        found.append(Claim(claim, said[body], measured, _verdict(holds)))
    return found


def _sigma_claims(sweep: pd.DataFrame, sigma: Mapping) -> list[Claim]:
    found = []
    table = sweep[(sweep["features"] == "ordered") & (sweep["weights"] == "nonnegative_a")]
    for (body, regime), rows in table.groupby(["body", "regime"], sort=False):
        if body not in sigma["unit_m"]:
            continue
        best = rows.loc[rows["rmse_of_peak"].idxmin()]
        unit_m = sigma["unit_m"][body]
        near = rows.loc[np.log(rows["sigma_m"] / (sigma["value"] * unit_m)).abs().idxmin()]
        excess = near["rmse_of_peak"] / best["rmse_of_peak"]
        measured = (
            f"best σ {best['sigma_m'] / unit_m:.2g} mesh units ({best['sigma_m']:.2g} m, "
            f"{best['sigma_relative']:.2g} of the median distance); "
            f"the σ nearest to {sigma['value']} has {excess:.3g} times its error"
        )
        claim = f"σ = {sigma['value']} is best for contact-ordered features ({body}, {regime} loads)"
        found.append(Claim(claim, f"{sigma['value']} in mesh units", measured, _verdict(excess <= 1.05)))
    return found


def _order_claims(complexity: pd.DataFrame) -> list[Claim]:
    names = {
        "sorting": "sorting costs",
        "building_phi": "building A costs, its inversion left out,",
        "building_a": "building A costs, its inversion included,",
        "building_w": "building w costs",
    }
    found = []
    for _, row in complexity.iterrows():
        parts, over, under = [], False, False
        for size in "rk":
            low, high = row[f"exponent_{size}_low"], row[f"exponent_{size}_high"]
            value, expected = row[f"exponent_{size}"], row[f"paper_exponent_{size}"]
            parts.append(f"{size}^{value:.2f} [{low:.2f}, {high:.2f}], expected {expected:.2f}")
            over |= expected < low and value > expected + ORDER_MARGIN
            under |= expected > high and value < expected - ORDER_MARGIN
        claim = f"{names[row['operation']]} {row['paper_order']}"
        verdict = "true as a bound" if under and not over else _verdict(not over)
        found.append(Claim(claim, row["paper_order"], "; ".join(parts), verdict))
    return found


def _ratio_claims(timing: pd.DataFrame, means: Mapping[str, Mapping[str, float]]) -> list[Claim]:
    found = []
    for body, table in timing.groupby("body", sort=False):
        seconds = table.set_index("method")["mean_s"]
        if body not in means:
            continue
        theirs = means[body]["unordered"] / means[body]["contact_ordered"]
        ratio = seconds["unordered"] / seconds["contact_ordered"]
        measured = (
            f"{ratio:.2g} times as fast: {1e3 * seconds['contact_ordered']:.3g} ms "
            f"against {1e3 * seconds['unordered']:.3g} ms"
        )
        claim = f"a contact-ordered query is {theirs:.1f} times as fast as an unordered one ({body})"
        holds = abs(ratio / theirs - 1) <= 0.25
        found.append(Claim(claim, f"{theirs:.1f} times as fast", measured, _verdict(holds)))
    return found


def _where(table: pd.DataFrame, **values: str) -> pd.DataFrame:
    for column, value in values.items():
        table = table[table[column] == value]
    return table


def _verdict(holds: bool) -> str:
    return "confirmed" if holds else "refuted"
