"""Judge paper 2's claims on errors, its figure 3: that they grow, stay small, and are least for the fitted press."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import BOUND, Claim, verdict
from palpate.studies.springs.claims import genetic

TABLES = ("spring_errors", "spring_fit")

BOUND_M = 0.005
"""The largest error that the paper reports, in all three presses."""
ORGAN_M = 0.1
"""Side of a cube of an organ's size, if the paper's bound is meant for one; it does not give the side of its own."""
_PART = 4
"""Errors grow if the mean of the last of so many parts of the steps exceeds that of the first."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on the genetic algorithm's springs without volume force; medians over the seeds."""
    errors, fits = (genetic(tables[name]) for name in TABLES)
    premise = "a cube of 10 mm held at its bottom, fitted to the top press in finite elements"
    yield _growth(errors, premise)
    yield from _bounds(errors, premise)
    yield _least(fits, premise)
    ours = "as printed it pulls a stretched tetrahedron further apart; ΣL − ΣL⁰ is used"
    claim = "the volume force keeps the volume with the bracket as printed"
    yield Claim(2, "1, equation 2", claim, "any tetrahedron, by the formula", "ΣL⁰ − ΣL", ours, verdict(False))


def _growth(errors: pd.DataFrame, premise: str) -> Claim:
    """Compare the first and the last part of the steps, for each axis of each press."""
    grown, signs = [], 0
    for _, rows in errors.groupby("press", sort=False):
        median = rows.groupby("step")[["error_x_m", "error_y_m", "error_z_m"]].median()
        parts = np.array_split(median.abs().to_numpy(), _PART)
        grown += (parts[-1].mean(axis=0) > parts[0].mean(axis=0)).tolist()
        signs += int(((median > 0).any() & (median < 0).any()).sum())
    ours = f"{sum(grown)} of {len(grown)} axes of presses; {signs} of them have errors of both signs"
    claim = "errors in x, y and z grow with the number of steps"
    return Claim(2, "2, figure 3", claim, premise, "in all three presses", ours, verdict(all(grown)))


def _bounds(errors: pd.DataFrame, premise: str) -> Iterator[Claim]:
    """Judge the bound as printed, which the zero answer meets, and scaled by the sides of an organ and of the cube."""
    largest = {
        press: (rows["most_m"].max(), rows["zero_m"].max()) for press, rows in errors.groupby("press", sort=False)
    }
    worst, zero = (1e3 * max(each) for each in zip(*largest.values(), strict=True))
    ours = f"{worst:.2g} mm at most; without any motion {zero:.2g} mm"
    claim = "errors of position stay below"
    below = worst < 1e3 * BOUND_M
    kind = verdict(below) if zero > 1e3 * BOUND_M else BOUND if below else verdict(False)
    yield Claim(2, "2, figure 3", claim, premise, "5 mm in all three presses", ours, kind)
    scaled = BOUND_M / ORGAN_M * 0.01
    shares = ", ".join(
        f"{press} {1e3 * error:.2g} of {1e3 * still:.2g} mm" for press, (error, still) in largest.items()
    )
    scale = f"{premise}; 5 mm on a cube of an organ's size, {ORGAN_M:g} m, are {1e3 * scaled:g} mm on one of 10 mm"
    kind = verdict(all(error < scaled for error, _ in largest.values()))
    yield Claim(2, "2, figure 3", f"{claim} 5 % of the cube's side", scale, "in all three presses", shares, kind)


def _least(fits: pd.DataFrame, premise: str) -> Claim:
    """Compare the fitted press with the two others."""
    medians = fits.groupby(["press", "used_in_fit"], sort=False)["rmse_m"].median().reset_index()
    used = medians["used_in_fit"].astype(bool)
    ours = ", ".join(f"{row.press} {1e3 * row.rmse_m:.2g} mm" for row in medians.itertuples())
    least = medians[used]["rmse_m"].max() < medians[~used]["rmse_m"].min()
    claim = "errors are least for the press that was fitted"
    return Claim(2, "2, figure 3", claim, premise, "least for the top press", ours, verdict(least))
