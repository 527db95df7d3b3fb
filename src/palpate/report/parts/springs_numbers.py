"""The numbers that the captions and the headline of paper 2's experiment name, worked out from its tables."""

import numpy as np
import pandas as pd

from palpate.figures import tables
from palpate.figures.number_format import percent, seconds
from palpate.figures.springs.spring_looks import FORCES, look

_FITTED, _OTHERS = 0.05, 0.15
"""RMSE of the peak up to which a fit is good, on its own press and on the others."""
_SEARCHES = ("genetic", "cma_es", "gradient")


def numbers(all_tables: dict[str, pd.DataFrame], published: dict) -> dict[str, str]:
    """Every placeholder of these captions, as text.

    published : workflow/report/springs.yaml, the paper's own numbers
    """
    fits, history, floor = (all_tables[name] for name in ("spring_fit", "spring_history", "spring_floor"))
    alone = tables.where(fits, volume_force=False)
    return {
        "source_springs": published["source"],
        "spring_paper_fitness": f"{published['fitness_m']:g}",
        "spring_paper_generations": f"{published['generations']:g}",
        "spring_paper_time": f"{published['seconds'] / 3600:g} h",
        "headline_springs": _headline(alone, history, published),
        "spring_found": _found(alone),
        "spring_found_volume": _found(tables.where(fits, volume_force=True)),
        "spring_passed": " and ".join(
            f"{_passed(history, force)} ({words})" for force, words in ((False, "springs alone"), (True, "with volume"))
        ),
        "spring_errors": "; ".join(f"{look(m).label} {_presses(alone, m)}" for m in ("uniform", "genetic", "gradient")),
        "spring_smooth": _presses(alone, "gradient_smooth"),
        "spring_smooth_volume": _presses(tables.where(fits, volume_force=True), "gradient_smooth"),
        "spring_met": _met(fits[~fits["method"].isin(["gradient_all"])]),
        "spring_all": _presses(alone, "gradient_all"),
        "spring_floor": _floor(tables.where(floor, volume_force=False)),
        "spring_floor_volume": _floor(tables.where(floor, volume_force=True)),
    }


def _found(fits) -> str:
    """Fitness and time of each search."""
    phrases = []
    for method in _SEARCHES:
        runs = tables.where(fits, method=method, used_in_fit=True)
        fitness, count = runs["fitness"], runs["seed"].nunique()
        among = f" ({fitness.min():.3g} to {fitness.max():.3g}, {count} seeds)" if count > 1 else ""
        taken = f"{seconds(runs['seconds'].median())}, {int(runs['generations'].max())} generations or iterations"
        phrases.append(f"{look(method).label} {fitness.median():.3g}{among} in {taken}")
    return "; ".join(phrases)


def _passed(history, force: bool) -> str:
    """When the gradient is better than the median of the genetic algorithm's ends."""
    runs = tables.where(history, volume_force=force)
    ends = tables.where(runs, method="genetic").groupby("seed")["fitness"].max()
    gradient = tables.where(runs, method="gradient")
    better = gradient[gradient["fitness"] > ends.median()]
    return f"after {seconds(better['seconds'].min())}" if len(better) else "never"


def _presses(fits, method: str) -> str:
    """The median error of each press."""
    medians = tables.where(fits, method=method).groupby("press", sort=False)["rmse_of_peak"].median()
    return ", ".join(f"{press} {percent(error)}" for press, error in medians.items())


def _met(fits) -> str:
    """The ways whose median errors are what is asked for, with and without the volume force; or none."""
    medians = fits.groupby(["volume_force", "method", "press", "used_in_fit"], sort=False)["rmse_of_peak"].median()
    bounds = [_FITTED if used else _OTHERS for used in medians.index.get_level_values("used_in_fit")]
    met = (medians <= bounds).groupby(level=["volume_force", "method"], sort=False).all()
    return ", ".join(f"{look(method).label} ({FORCES[force]})" for force, method in met.index[met]) or "none"


def _floor(floor) -> str:
    """The worst press at each Poisson ratio."""
    worst = floor.groupby("poisson")["rmse_of_peak"].max()
    return ", ".join(f"{percent(error)} at {poisson:g}" for poisson, error in worst.items())


def _headline(alone, history, published) -> str:
    """What the gradient is to the genetic algorithm, in one sentence."""
    genetic = tables.where(alone, method="genetic", used_in_fit=True)
    gradient = tables.where(alone, method="gradient", used_in_fit=True)["fitness"].median()
    ahead = 1.0 - gradient / np.median(genetic["fitness"])
    return (
        f"{int(genetic['generations'].max())} generations of paper 2's genetic algorithm take "
        f"{seconds(genetic['seconds'].median())} (the paper: about {published['seconds'] / 3600:g} h); the adjoint's "
        f"gradient is past them {_passed(history, False)} and ends with {percent(ahead)} less error on the press that "
        f"both are fitted to."
    )
