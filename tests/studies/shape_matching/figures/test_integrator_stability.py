"""The figure of stability names the step at which an integrator becomes unstable."""

from fixtures.drawn import texts

from palpate.studies.shape_matching import figures


def test_the_step_at_which_it_becomes_unstable_is_named(shape_matching_results):
    table = shape_matching_results["integrator_stability"]
    written = "\n".join(texts(figures.draw_integrator_stability(table)))
    assert f"from {table['blow_up_measured'].min():.4f} (stated limit 2.0000)" in written
    assert "goal positions, α = 0.5" in written
