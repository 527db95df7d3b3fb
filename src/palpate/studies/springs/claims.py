"""Judge paper 2's claims on its genetic algorithm: its fitness, its time, and its errors on three presses."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.number_text import percent_in_table as percent
from palpate.report.claims import BOUND, Claim, claims, not_testable, verdict
from palpate.report.tables import where
from palpate.scenes.acting_effects import SPRING_POISSON

FITNESS_M, GENERATIONS, SECONDS = -0.05, 1000, 3600
"""Where the search ends in figure 2, and after how long."""
_HOLDS = 1.5
"""Moduli hold for a load that they were not fitted to if its error is less than so many times the fitted one."""
_LESS = 0.8
"""An error is clearly smaller if it is less than this fraction of the other."""
_MAGNITUDE = 10.0
"""A search is an order of magnitude faster if it needs this factor less time for the same fitness."""
_LATE, _GAIN = 0.1, 0.05
"""A search has converged if the fitness gained in its last tenth is less than this fraction of the whole gain."""
PAPERS = {"method": "genetic", "volume_force": False}
"""The rows of the paper's own search, without volume force."""


@claims("spring_fit", "spring_history", "spring_floor")
def searches(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on searches of spring moduli, without volume force and as medians over the seeds."""
    fits, history = (where(tables[name], **PAPERS) for name in ("spring_fit", "spring_history"))
    fitted, other_presses = (where(fits, used_in_fit=in_fit) for in_fit in (True, False))
    count, seeds = int(fitted["generations"].max()), fitted["seed"].nunique()
    runs = f"median of {seeds} seeds" if seeds > 1 else "one seed"
    premise = f"a cube of 120 nodes and 590 springs, fitted to finite elements; {count} generations, {runs}"
    yield _fitness(fitted["fitness"].median(), count, premise)
    yield _converged(history, premise)
    published, ours = f"about {SECONDS / 3600:g} h", f"{fitted['seconds'].median():.2g} s"
    why = "the paper does not name its machine"
    yield Claim(2, "2", "the search takes", premise, published, ours, not_testable(why))
    yield _holds(fitted["rmse_of_peak"].median(), other_presses, premise)
    yield _volume(tables["spring_floor"])
    yield _fixed_ratio(tables["spring_floor"])
    yield from _searches(tables["spring_history"], premise)
    claim, ours = "springs are damped by", "2 ratio sqrt(k m₁m₂/(m₁ + m₂)) instead"
    why = "its unit is not N s/m; in metres it is thousands of times what lets the cube move"
    yield Claim(2, "1, equation 6", claim, "any", "2 sqrt(k (m₁ + m₂))/l", ours, not_testable(why))


def _fitness(reached: float, count: int, premise: str) -> Claim:
    published = f"{FITNESS_M:g} after {GENERATIONS} generations"
    why = "the paper gives neither its material nor its key points nor its steps, on which the sum depends"
    claim = "the genetic algorithm ends at a fitness of"
    return Claim(2, "2, figure 2", claim, premise, published, f"{reached:.3g} after {count}", not_testable(why))


def _converged(history: pd.DataFrame, premise: str) -> Claim:
    """Judge whether the last tenth of generations brings less than _GAIN of the gain in fitness, as median of seeds."""
    fractions = []
    for _, run in history.groupby("seed"):
        best_fitness = run.sort_values("generation").set_index("generation")["fitness"].cummax()
        before_last_tenth = best_fitness[best_fitness.index <= (1 - _LATE) * best_fitness.index.max()].iloc[-1]
        whole_gain = best_fitness.iloc[-1] - best_fitness.iloc[0]
        fractions.append((best_fitness.iloc[-1] - before_last_tenth) / whole_gain if whole_gain else 0.0)
    fraction, count = float(pd.Series(fractions).median()), int(history["generation"].max())
    ours = f"the last tenth of {count} generations brings {percent(fraction)} of the gain"
    claim = "the genetic algorithm has converged after"
    return Claim(2, "2, figure 2", claim, premise, f"about {GENERATIONS} generations", ours, verdict(fraction < _GAIN))


def _holds(fitted_error: float, other_presses: pd.DataFrame, premise: str) -> Claim:
    worst = other_presses.groupby("press")["rmse_of_peak"].median().max()
    ours = f"{percent(fitted_error)} of the peak on the fitted press, up to {percent(worst)} on the others"
    claim = "moduli fitted to the top press hold for the left and the front press too"
    return Claim(2, "2, figure 3", claim, premise, "they do", ours, verdict(worst < _HOLDS * fitted_error))


def _volume(floor: pd.DataFrame) -> Claim:
    """Judge the volume force by springs fitted to all presses of the least compressible tissue."""
    poisson = floor["poisson"].max()
    worst = where(floor, poisson=poisson).groupby("volume_force")["rmse_of_peak"].max()
    ours = f"{percent(worst[True])} of the peak with the force, {percent(worst[False])} without"
    fit = "moduli and stiffness of the force fitted to all three presses"
    premise, holds = f"the same cube, Poisson's ratio {poisson:g}, {fit}", worst[True] < _LESS * worst[False]
    claim = "a volume force lets springs follow tissue that keeps its volume"
    return Claim(2, "1, equation 2", claim, premise, "it preserves volume", ours, verdict(holds))


def _fixed_ratio(floor: pd.DataFrame) -> Claim:
    """Judge by the Poisson's ratio of the tissue that springs alone follow best, fitted to all presses at once."""
    errors = where(floor, volume_force=False).groupby("poisson")["rmse_of_peak"].mean()
    best = float(errors.idxmin())
    ours = "mean error " + ", ".join(f"{percent(error)} at {poisson:g}" for poisson, error in errors.items())
    claim = "springs without a volume force have one Poisson's ratio, whatever their moduli"
    premise = f"the same cube, tissues of {len(errors)} ratios, moduli fitted to all three presses"
    nearest = errors.index[(errors.index - SPRING_POISSON).to_series().abs().to_numpy().argmin()]
    return Claim(2, "beyond the paper", claim, premise, "1/4", f"{ours}; least at {best:g}", verdict(best == nearest))


def _searches(history: pd.DataFrame, premise: str) -> Iterator[Claim]:
    """Judge the times [s] until other searches are as fit as the genetic algorithm at its end, as medians of seeds."""
    genetic_s = where(history, **PAPERS).groupby("seed")["seconds"].max().median()
    for method, words in (("gradient", "the gradient by the adjoint"), ("cma_es", "CMA-ES")):
        if where(history, method=method, volume_force=False).empty:
            continue
        found_s, ours = as_fit_after(history, method, False), "not as fit at its end"
        if found_s is not None:
            ours = f"as fit after {found_s:.2g} s as the genetic algorithm after {genetic_s:.2g} s"
        claim = f"{words} beats the genetic algorithm by orders of magnitude in time"
        holds = found_s is not None and genetic_s / found_s >= _MAGNITUDE
        yield Claim(2, "beyond the paper", claim, premise, "ten times or more", ours, verdict(bool(holds)))


def as_fit_after(history: pd.DataFrame, method: str, force: bool) -> float | None:
    """Return when [s] a search has the genetic algorithm's final fitness; medians over seeds, None if some never do.

    force : whether springs have the volume force
    """
    runs = where(history, volume_force=force)
    wanted_fitness = where(runs, method="genetic").groupby("seed")["fitness"].max().median()
    rows = where(runs, method=method)
    first_s = rows[rows["fitness"] >= wanted_fitness].groupby("seed")["seconds"].min()
    return float(first_s.median()) if 0 < len(first_s) == rows["seed"].nunique() else None


BOUND_M = 0.005
"""The largest error that the paper reports, in all three presses."""
ORGAN_M = 0.1
"""Side of a cube of an organ's size, if the paper's bound is meant for one; it does not give the side of its own."""
_PART = 4
"""Equal parts of the steps: errors grow if their mean over the last part exceeds that over the first."""


@claims("spring_errors", "spring_fit")
def presses(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on the errors of the genetic algorithm's springs, without volume force and over all seeds."""
    errors, fits = (where(tables[name], **PAPERS) for name in ("spring_errors", "spring_fit"))
    premise = "a cube of 10 mm held at its bottom, fitted to the top press in finite elements"
    yield _growth(errors, premise)
    yield from _bounds(errors, premise)
    yield _least(fits, premise)
    ours = "as printed it pulls a stretched tetrahedron further apart; ΣL − ΣL⁰ is used"
    claim = "the volume force keeps the volume with the bracket as printed"
    yield Claim(2, "1, equation 2", claim, "any tetrahedron, by the formula", "ΣL⁰ − ΣL", ours, verdict(False))


def _growth(errors: pd.DataFrame, premise: str) -> Claim:
    """Judge whether errors along x, y, z are larger in the last quarter of steps than in the first, by medians."""
    grown, with_both_signs = [], 0
    for _, rows in errors.groupby("press", sort=False):
        median = rows.groupby("step")[["error_x_m", "error_y_m", "error_z_m"]].median()
        quarters = np.array_split(median.abs().to_numpy(), _PART)
        grown += (quarters[-1].mean(axis=0) > quarters[0].mean(axis=0)).tolist()
        with_both_signs += int(((median > 0).any() & (median < 0).any()).sum())
    ours = f"{sum(grown)} of {len(grown)} axes of presses; {with_both_signs} of them have errors of both signs"
    claim = "errors in x, y and z grow with the number of steps"
    return Claim(2, "2, figure 3", claim, premise, "in all three presses", ours, verdict(all(grown)))


def _bounds(errors: pd.DataFrame, premise: str) -> Iterator[Claim]:
    """Judge the paper's bound of errors as printed, which no motion at all meets, too, and scaled to the cube."""
    largest = errors.groupby("press", sort=False)[["most_m", "zero_m"]].max()
    worst_mm, motion_mm = 1e3 * largest.max()
    ours = f"{worst_mm:.2g} mm at most; without any motion {motion_mm:.2g} mm"
    claim = "errors of position stay below"
    below = worst_mm < 1e3 * BOUND_M
    judged = verdict(below) if motion_mm > 1e3 * BOUND_M else BOUND if below else verdict(False)
    yield Claim(2, "2, figure 3", claim, premise, "5 mm in all three presses", ours, judged)
    scaled = BOUND_M / ORGAN_M * 0.01
    by_press = ", ".join(
        f"{press} {1e3 * error:.2g} of {1e3 * motion_m:.2g} mm" for press, error, motion_m in largest.itertuples()
    )
    scale = f"{premise}; 5 mm on a cube of an organ's size, {ORGAN_M:g} m, are {1e3 * scaled:g} mm on one of 10 mm"
    judged = verdict(bool((largest["most_m"] < scaled).all()))
    yield Claim(2, "2, figure 3", f"{claim} 5 % of the cube's side", scale, "in all three presses", by_press, judged)


def _least(fits: pd.DataFrame, premise: str) -> Claim:
    medians = fits.groupby(["press", "used_in_fit"], sort=False)["rmse_m"].median().reset_index()
    fitted = medians["used_in_fit"].astype(bool)
    ours = ", ".join(f"{row.press} {1e3 * row.rmse_m:.2g} mm" for row in medians.itertuples())
    fitted_is_least = medians[fitted]["rmse_m"].max() < medians[~fitted]["rmse_m"].min()
    claim = "errors are least for the press that was fitted"
    return Claim(2, "2, figure 3", claim, premise, "least for the top press", ours, verdict(fitted_is_least))
