"""The part about shape matching follows from its tables."""

import pytest
from fixtures.material import numbers

PUBLISHED = {"source": "a thesis", "steps_1_s": 50}


def test_numbers_come_from_the_tables(shape_matching_results):
    found = numbers("shape_matching", shape_matching_results, PUBLISHED)
    assert found["limit"] == pytest.approx(2.001) and found["tips"].tolist() == pytest.approx([0.028, 0.084], abs=6e-4)
    assert found["slopes"]["exponent"].tolist() == pytest.approx([1.0] * len(found["slopes"]))
    assert found["left"]["quadratic"].max() == 1e-15 and found["left"].loc["bent", "linear"] == 0.5
    assert found["closeness"] == pytest.approx(0.01)
    assert found["poked"][["nodes moved", "of"]].to_numpy().tolist() == [[30, 30], [12, 30]]
    assert found["poked"]["left [%]"].tolist() == pytest.approx([20.0, 0.0])
