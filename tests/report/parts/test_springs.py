"""Sentences and tables about spring parameters have the numbers of their tables."""

from palpate.report.numbers import numbers
from palpate.report.parts import springs

PUBLISHED = {"springs": {"source": "Chen", "fitness_m": -0.05, "generations": 1000, "seconds": 3600}}


def test_sentences_come_from_the_tables(spring_results):
    found = numbers(spring_results, PUBLISHED, ["springs"], [])
    found = {name: text.replace("\u00a0", " ") for name, text in found.items()}
    assert found["spring_found"].startswith(
        "genetic algorithm (the paper) -0.066 (-0.072 to -0.06, 3 seeds) in 10 s, 20 generations or iterations"
    )
    # -0.03 - 0.5 (1 - i/10) is above -0.066 at i = 10 only
    assert found["spring_passed"].startswith("after 11 s (springs alone)")
    assert found["spring_smooth"] == "top 4.5 %, left 14 %, front 14 %"
    ways = (
        "gradient by the adjoint ({0}), gradient, regularised moduli ({0})"  # 3 and 4.5 %, others 3 times
    )
    forces = ("springs alone", "springs and volume force")
    assert found["spring_met"] == ", ".join(ways.format(force) for force in forces)
    assert found["spring_all"] == "top 4 %, left 4 %, front 4 %"
    assert found["spring_floor"] == "11 % at 0.1, 12 % at 0.25, 15 % at 0.49"
    assert (
        "(the paper: about 1 h); the adjoint's gradient is past them after 11 s and ends with 55 % less error on"
        in (found["headline_springs"])
    )


def test_a_gradient_that_never_passes_is_reported(spring_results):
    history = spring_results["spring_history"].copy()
    history.loc[history["method"] == "gradient", "fitness"] = -1.0
    found = numbers(spring_results | {"spring_history": history}, PUBLISHED, ["springs"], [])
    assert found["spring_passed"] == "never (springs alone) and never (with volume)"


def test_medians_and_ranges_are_tabulated(spring_results):
    text = springs._medians(spring_results["spring_fit"]).replace("\u00a0", " ")
    assert "6.6 % [6 %, 7.2 %] (fitted)" in text and "20 % [18 %, 22 %]" in text
