"""What paper 2 says of its genetic algorithm is judged by the fits of springs."""

from pathlib import Path

from palpate.files import read_yaml
from palpate.report.claims import CONFIRMED, NOT_TESTABLE, REFUTED
from palpate.studies.springs.claims import FITNESS_M, GENERATIONS, SECONDS, searches

PAPER = read_yaml(Path(__file__).parents[3] / "src/palpate/studies/springs/captions/published.yaml")


def verdict(tables, claim):
    (word,) = [row.verdict for row in searches(tables) if row.claim.startswith(claim)]
    return word


def test_published_numbers_are_those_of_the_figures():
    theirs = {key: PAPER[key] for key in ("fitness_m", "generations", "seconds")}
    assert theirs == {"fitness_m": FITNESS_M, "generations": GENERATIONS, "seconds": SECONDS}


def test_one_press_is_not_enough_where_the_others_are_wrong(spring_results):
    # conftest: the presses that are not fitted are three times as wrong
    assert verdict(spring_results, "moduli fitted") == REFUTED
    fits = spring_results["spring_fit"].copy()
    fits.loc[~fits["used_in_fit"], "rmse_of_peak"] /= 2.5
    assert verdict(spring_results | {"spring_fit": fits}, "moduli fitted") == CONFIRMED


def test_a_search_that_still_gains_has_not_converged(spring_results):
    # conftest: it gains the same in each generation
    assert verdict(spring_results, "the genetic algorithm has converged") == REFUTED
    history = spring_results["spring_history"].copy()
    history.loc[history["generation"] > 10, "fitness"] = -0.01
    history.loc[history["generation"] <= 10, "fitness"] -= 1.0
    assert verdict(spring_results | {"spring_history": history}, "the genetic algorithm has converged") == CONFIRMED


def test_what_cannot_be_compared_says_why(spring_results):
    said = [row.verdict for row in searches(spring_results) if row.verdict.startswith(NOT_TESTABLE)]
    assert len(said) == 3 and any("machine" in word for word in said)


def test_a_volume_force_has_to_help_clearly(spring_results):
    # conftest: 0.1 without it, 0.06 with it
    assert verdict(spring_results, "a volume force") == CONFIRMED
    floor = spring_results["spring_floor"].copy()
    floor.loc[floor["volume_force"], "rmse_of_peak"] *= 1.4
    assert verdict(spring_results | {"spring_floor": floor}, "a volume force") == REFUTED
