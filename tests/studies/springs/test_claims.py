"""What paper 2 says of its genetic algorithm is judged by the fits of springs."""

from pathlib import Path

import numpy as np
import pytest

from palpate.files import read_yaml
from palpate.report.claims import BOUND, CONFIRMED, NOT_TESTABLE, REFUTED
from palpate.studies.springs.claims import FITNESS_M, GENERATIONS, SECONDS, presses, searches

PAPER = read_yaml(Path(__file__).parents[3] / "src/palpate/studies/springs/published.yaml")


def test_published_numbers_are_those_of_the_figures():
    theirs = {key: PAPER[key] for key in ("fitness_m", "generations", "seconds")}
    assert theirs == {"fitness_m": FITNESS_M, "generations": GENERATIONS, "seconds": SECONDS}


def no_worse_elsewhere(fits):
    return fits.assign(rmse_of_peak=fits["rmse_of_peak"] / np.where(fits["used_in_fit"], 1.0, 2.5))


def ended_early(history):
    return history.assign(fitness=np.where(history["generation"] > 10, -0.01, history["fitness"] - 1.0))


def hardly_helped(floor):
    return floor.assign(rmse_of_peak=floor["rmse_of_peak"] * np.where(floor["volume_force"], 1.4, 1.0))


@pytest.mark.parametrize(
    ("claim", "name", "change", "words"),
    [  # conftest: presses that are not fitted are three times as wrong, each generation gains the same, 0.1 and 0.06
        ("moduli fitted", "spring_fit", no_worse_elsewhere, [REFUTED, CONFIRMED]),
        ("the genetic algorithm has converged", "spring_history", ended_early, [REFUTED, CONFIRMED]),
        ("a volume force", "spring_floor", hardly_helped, [CONFIRMED, REFUTED]),
    ],
)
def test_a_claim_follows_its_table(spring_results, claim, name, change, words):
    cases = spring_results, spring_results | {name: change(spring_results[name])}
    assert [row.verdict for tables in cases for row in searches(tables) if row.claim.startswith(claim)] == words


def test_what_cannot_be_compared_says_why(spring_results):
    said = [row.verdict for row in searches(spring_results) if row.verdict.startswith(NOT_TESTABLE)]
    assert len(said) == 3 and any("machine" in word for word in said)


def test_claims_on_errors_have_their_verdicts(spring_results):
    grown, bound, scaled, least, sign = presses(spring_results)
    assert {claim.verdict for claim in (grown, scaled, least)} == {CONFIRMED} and bound.verdict == BOUND
    assert bound.ours == "0.022 mm at most; without any motion 0.5 mm"
    assert scaled.ours == "top 0.0072 of 0.5 mm, left 0.022 of 0.5 mm, front 0.022 of 0.5 mm"
    assert sign.verdict == REFUTED and "further apart" in sign.ours


def test_other_errors_refute_them(spring_results):
    """Errors along x that vanish in the end, more than 5 mm in all, and least where nothing was fitted."""
    errors, fits = spring_results["spring_errors"], spring_results["spring_fit"]
    errors = errors.assign(error_x_m=errors["error_x_m"] * (errors["step"] < 5), most_m=300.0 * errors["most_m"])
    wrong = spring_results | {"spring_errors": errors, "spring_fit": fits.assign(rmse_m=1.0 / fits["rmse_m"])}
    assert [claim.verdict for claim in presses(wrong)][:4] == [REFUTED] * 4
