"""The part about shape matching follows from its tables."""

import pytest
from fixtures.material import numbers, page

PUBLISHED = {"source": "a thesis", "steps_1_s": 50}


def test_numbers_come_from_the_tables(shape_matching_results):
    found = numbers("shape_matching", shape_matching_results, PUBLISHED)
    assert found["limit"] == pytest.approx(2.001) and found["never"] == ["goal position"]
    assert found["growth_error"] == pytest.approx(0.002) and found["column_particles"] == found["block_particles"] == 3
    assert found["tips_cm"] == pytest.approx({1: 2.8, 2: 8.4}, abs=0.06)
    assert [(row.Index, *row[1:]) for row in found["slopes"]] == [
        ("linear", pytest.approx(1.0), pytest.approx(1.0)), ("quadratic", pytest.approx(1.0), pytest.approx(1.0)),
    ]  # fmt: skip
    assert max(found["left"]["quadratic"].values()) == 1e-15 and found["left"]["linear"]["bent"] == 0.5
    assert (found["letter"]["clusters_most"], found["letter"]["alpha_limit_measured"]) == (30, 0.151)
    assert (found["cheaper"], found["drift"]) == (pytest.approx(0.1), 2e-16)
    creep = {"scene": "strip creep", "error": pytest.approx(0.01), "late": pytest.approx(0.39, abs=0.005)}
    assert found["creep"] == creep
    assert [(row["moved"], row["nodes"], row["left"]) for row in found["poked"]] == [
        (30, 30, pytest.approx(0.2)), (12, 30, pytest.approx(0.0)),
    ]  # fmt: skip
    text = " ".join(page("shape_matching", shape_matching_results, PUBLISHED).split())
    assert "quadratic clusters each, takes 1.6 ms on one core (the thesis: 20 ms)" in text
