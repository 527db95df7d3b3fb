"""Sentences about shape matching follow from their tables."""

from fixtures.material import numbers


def test_sentences_come_from_the_tables(shape_matching_results):
    found = numbers("shape_matching", shape_matching_results, {"source": "a thesis", "steps_1_s": 50})
    assert "quadratic clusters each, takes 1.6 ms on one core (the thesis: 20 ms)" in found["headline"]
    assert found["blow_up"] == "2.0010 sqrt(m/k), 0.05 % from 2"
    assert found["never"] == "goal position"
    assert found["growth_error"] == "0.2 %"
    assert found["bent"] == "2.8 cm with 1, 8.4 cm with 2"
    assert found["column_particles"] == "3"
    assert found["slopes"] == "quadratic 1.00 to 1.00"
    assert found["poked"] == (
        "without: 20 mm deep, 30 of 30 nodes moved, 20 % left; 10 N/m: 20 mm deep, 12 of 30 nodes moved, 0 % left"
    )
