"""The part about spring parameters has the numbers of its tables."""

import pytest
from fixtures.material import numbers

from palpate.report.model_looks import look

PUBLISHED = {"source": "Chen", "fitness_m": -0.05, "generations": 1000, "seconds": 3600}


def test_numbers_come_from_the_tables(spring_results):
    found = numbers("springs", spring_results, PUBLISHED)
    # -0.03 - 0.5 (1 - i/10) is above -0.066 at i = 10 only
    assert found["passed"]["springs alone"] == pytest.approx(11.0) and found["ahead"] == pytest.approx(0.55, abs=0.005)
    # 3 and 4.5 %, others three times as much
    ways = [look(method).label for method in ("gradient", "gradient_smooth")]
    forces = ("springs alone", "springs and volume force")
    assert found["met"] == [f"{way} ({force})" for force in forces for way in ways]
