"""The part about spring parameters has the numbers of its tables."""

import pytest
from fixtures.material import numbers, page

from palpate.studies.springs import report as springs

PUBLISHED = {"source": "Chen", "fitness_m": -0.05, "generations": 1000, "seconds": 3600}


def test_numbers_come_from_the_tables(spring_results):
    found = numbers("springs", spring_results, PUBLISHED)
    genetic = found["found"]["springs alone"][0]
    assert [genetic[key] for key in ("median", "least", "most", "seeds", "seconds")] == [-0.066, -0.072, -0.06, 3, 10.0]
    # -0.03 - 0.5 (1 - i/10) is above -0.066 at i = 10 only
    assert found["passed"]["springs alone"] == pytest.approx(11.0) and found["ahead"] == pytest.approx(0.55, abs=0.005)
    # 3 and 4.5 %, others three times as much
    ways = [springs.look(method).label for method in ("gradient", "gradient_smooth")]
    forces = ("springs alone", "springs and volume force")
    assert found["met"] == [f"{way} ({force})" for force in forces for way in ways]
    assert found["all"] == pytest.approx({"top": 0.04, "left": 0.04, "front": 0.04})
    assert found["floor"]["springs alone"] == pytest.approx({0.1: 0.11, 0.25: 0.12, 0.49: 0.15}, abs=0.006)
    text = " ".join(page("springs", spring_results, PUBLISHED).split())
    assert "(the paper: about 1 h); the gradient from the adjoint reaches its fitness after 11 s" in text
    assert "ends with 55 % less error" in text
    history = spring_results["spring_history"].copy()
    history.loc[history["method"] == "gradient", "fitness"] = -1.0
    assert "never reaches its fitness" in page("springs", spring_results | {"spring_history": history}, PUBLISHED)
