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
    assert found["slopes"] == "linear 1.00 to 1.00, quadratic 1.00 to 1.00"
    assert found["block_particles"] == "3" and found["quadratic_left"] == "1e-15"
    assert found["linear_left"] == "50 % of the bent deformation"
    assert found["literal"] == (
        "70 clusters, 20 a particle and 30 at most, are unstable from α = 0.151 on (by the largest eigenvalue 0.150)"
    )
    assert found["cheaper"] == "10 %" and found["drift"] == "2e-16"
    assert found["tips"].startswith("the tip moves 10 cm (covered once, averaged)")
    assert found["creep_scene"] == "strip creep" and found["creep_error"] == "1 %" and found["creep_late"] == "39 %"
    assert found["poked"] == (
        "without: 20 mm deep, 30 of 30 nodes moved, 20 % left; 10 N/m: 20 mm deep, 12 of 30 nodes moved, 0 % left"
    )
