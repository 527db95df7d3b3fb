"""Sentences and tables about spring parameters have the numbers of their tables."""

from fixtures.material import numbers

from palpate.studies.springs import report as springs

PUBLISHED = {"source": "Chen", "fitness_m": -0.05, "generations": 1000, "seconds": 3600}


def test_sentences_come_from_the_tables(spring_results):
    found = numbers("springs", spring_results, PUBLISHED)
    assert found["spring_found"].startswith(
        "genetic algorithm (the paper) -0.066 (-0.072 to -0.06, 3 seeds) in 10 s, 20 generations or iterations"
    )
    # -0.03 - 0.5 (1 - i/10) is above -0.066 at i = 10 only
    assert found["spring_passed"].startswith("after 11 s (springs alone)")
    assert found["spring_smooth"] == "top 4.5 %, left 14 %, front 14 %"
    # 3 and 4.5 %, others three times as much
    ways = [springs.look(method).label for method in ("gradient", "gradient_smooth")]
    forces = ("springs alone", "springs and volume force")
    assert found["spring_met"] == ", ".join(f"{way} ({force})" for force in forces for way in ways)
    assert found["spring_all"] == "top 4 %, left 4 %, front 4 %"
    assert found["spring_floor"] == "11 % at 0.1, 12 % at 0.25, 15 % at 0.49"
    assert "(the paper: about 1 h); the gradient from the adjoint reaches its fitness after 11 s" in found["headline"]
    assert "ends with 55 % less error" in found["headline"]


def test_a_gradient_that_never_passes_is_reported(spring_results):
    history = spring_results["spring_history"].copy()
    history.loc[history["method"] == "gradient", "fitness"] = -1.0
    found = numbers("springs", spring_results | {"spring_history": history}, PUBLISHED)
    assert found["spring_passed"] == "never (springs alone) and never (with volume)"
    assert "never reaches its fitness" in found["headline"]


def test_medians_and_ranges_are_tabulated(spring_results):
    text = springs._medians(spring_results["spring_fit"]).replace("\u00a0", " ")
    assert '<th scope="col" class=number>top press (fitted)</th>' in text and "left press</th>" in text
    assert "6.6 % [6 %, 7.2 %]" in text and "20 % [18 %, 22 %]" in text
