"""Report on paper 2: how well each method fits springs, how errors grow, and what springs can do at all."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import percent, seconds
from palpate.report.spring_looks import FORCES, look
from palpate.studies.springs.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Paper 2: spring parameters"
_FITTED, _OTHERS = 0.05, 0.15
"""RMSE of the peak up to which a fit is good, on its own press and on the others."""
_SEARCHES = ("genetic", "cma_es", "gradient")


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    published = report.published["springs"]
    fits, history, floor = (report.tables[name] for name in ("spring_fit", "spring_history", "spring_floor"))
    alone, helped = (tables.where(fits, volume_force=force) for force in (False, True))
    return {
        "headline": _headline(alone, history, published),
        "source": published["source"],
        "spring_paper_fitness": f"{published['fitness_m']:g}",
        "spring_paper_generations": f"{published['generations']:g}",
        "spring_paper_time": f"{published['seconds'] / 3600:g} h",
        "spring_found": _found(alone),
        "spring_found_volume": _found(helped),
        "spring_passed": " and ".join(
            f"{_passed(history, force)} ({words})" for force, words in ((False, "springs alone"), (True, "with volume"))
        ),
        "spring_errors": "; ".join(f"{look(m).label} {_presses(alone, m)}" for m in ("uniform", "genetic", "gradient")),
        "spring_zero": f"at most {1e3 * report.tables['spring_errors']['zero_m'].max():.2g} mm",
        "spring_largest": _largest(tables.where(report.tables["spring_errors"], method="genetic", volume_force=False)),
        "spring_smooth": _presses(alone, "gradient_smooth"),
        "spring_smooth_volume": _presses(helped, "gradient_smooth"),
        "spring_met": _met(fits[~fits["method"].isin(["gradient_all"])]),
        "spring_all": _presses(alone, "gradient_all"),
        "spring_floor": _floor(tables.where(floor, volume_force=False)),
        "spring_floor_volume": _floor(tables.where(floor, volume_force=True)),
    }


def _found(fits: pd.DataFrame) -> str:
    """Return fitness and time of each search."""
    phrases = []
    for method in _SEARCHES:
        runs = tables.where(fits, method=method, used_in_fit=True)
        fitness, count = runs["fitness"], runs["seed"].nunique()
        among = f" ({fitness.min():.3g} to {fitness.max():.3g}, {count} seeds)" if count > 1 else ""
        taken = f"{seconds(runs['seconds'].median())}, {int(runs['generations'].max())} generations or iterations"
        phrases.append(f"{look(method).label} {fitness.median():.3g}{among} in {taken}")
    return "; ".join(phrases)


def _passed(history: pd.DataFrame, force: bool) -> str:
    """Return when the gradient is better than the median of the genetic algorithm's ends."""
    runs = tables.where(history, volume_force=force)
    ends = tables.where(runs, method="genetic").groupby("seed")["fitness"].max()
    gradient = tables.where(runs, method="gradient")
    better = gradient[gradient["fitness"] > ends.median()]
    return f"after {seconds(better['seconds'].min())}" if len(better) else "never"


def _presses(fits: pd.DataFrame, method: str) -> str:
    """Return the median error of each press."""
    medians = tables.where(fits, method=method).groupby("press", sort=False)["rmse_of_peak"].median()
    return ", ".join(f"{press} {percent(error)}" for press, error in medians.items())


def _largest(errors: pd.DataFrame) -> str:
    """Return the largest error of a key point along an axis in each press."""
    return ", ".join(
        f"{press} {1e3 * most:.2g} mm" for press, most in errors.groupby("press", sort=False)["most_m"].max().items()
    )


def _met(fits: pd.DataFrame) -> str:
    """Name the methods whose median errors are small enough, with and without the volume force; or none."""
    medians = fits.groupby(["volume_force", "method", "press", "used_in_fit"], sort=False)["rmse_of_peak"].median()
    bounds = [_FITTED if used else _OTHERS for used in medians.index.get_level_values("used_in_fit")]
    met = (medians <= bounds).groupby(level=["volume_force", "method"], sort=False).all()
    return ", ".join(f"{look(method).label} ({FORCES[force]})" for force, method in met.index[met]) or "none"


def _floor(floor: pd.DataFrame) -> str:
    """Return the largest error of a press at each Poisson ratio."""
    worst = floor.groupby("poisson")["rmse_of_peak"].max()
    return ", ".join(f"{percent(error)} at {poisson:g}" for poisson, error in worst.items())


def _headline(alone: pd.DataFrame, history: pd.DataFrame, published: dict) -> str:
    """Compare the gradient with the genetic algorithm, in one sentence."""
    genetic = tables.where(alone, method="genetic", used_in_fit=True)
    gradient = tables.where(alone, method="gradient", used_in_fit=True)["fitness"].median()
    ahead = 1.0 - gradient / np.median(genetic["fitness"])
    passed = _passed(history, False)
    better = "never reaches its fitness" if passed == "never" else f"reaches its fitness {passed}"
    return (
        f"{int(genetic['generations'].max())} generations of paper 2's genetic algorithm take "
        f"{seconds(genetic['seconds'].median())} (the paper: about {published['seconds'] / 3600:g} h); the gradient "
        f"from the adjoint {better} and ends with {percent(ahead)} less error on the press that both are fitted to."
    )


def sections(report: Report) -> list[Section]:
    """Return a figure each, and the tables that belong to it."""
    fits = report.figure("spring_fit") + _medians(report.tables["spring_fit"])
    return [
        ("spring_search", "Finding spring parameters", fits + report.folded("spring_fit", "spring_history")),
        ("spring_presses", "Errors over time", report.figure("spring_errors") + report.folded("spring_errors")),
        ("spring_trust", "The limits of springs", report.figure("spring_floor") + report.folded("spring_floor")),
    ]


def _medians(fits: pd.DataFrame) -> str:
    """Tabulate the median of the seeds and, where there are several, their range."""
    used = fits.groupby("press", sort=False)["used_in_fit"].mean()
    fitted, rows = set(used.index[used == used.max()]), []
    for (force, method), runs in fits.groupby(["volume_force", "method"], sort=False):
        row = {"forces": FORCES[force], "method": look(method).label}
        row |= {"time": seconds(runs[runs["used_in_fit"]].groupby("seed")["seconds"].first().median())}
        row |= {"fitness [m]": runs[runs["press"] == fits["press"].iloc[0]]["fitness"].median()}
        for press, found in runs.groupby("press", sort=False):
            row[f"{press} press{' (fitted)' if press in fitted else ''}"] = spread(found["rmse_of_peak"], percent)
        rows.append(row)
    caption = "Fitness of the top press, and RMSE of the peak displacement: median [least, largest] of the seeds"
    return markup.table(pd.DataFrame(rows), caption)


def spread(values: pd.Series, words: Callable[[float], str]) -> str:
    """Return the median, and the range if there are several values."""
    median, least, largest = (words(value) for value in (values.median(), values.min(), values.max()))
    return median if len(values) == 1 else f"{median} [{least}, {largest}]"
