"""Deviations of the total mass are drawn with and without the correction at the organ's rim."""

from palpate.studies.ct import figures


def test_masses_are_drawn_with_and_without_the_rim(ct_results):
    deviation = figures.draw_node_mass(ct_results["node_mass"]).axes[0]
    dashed, plain = deviation.lines[:2]
    assert plain.get_ydata().tolist() == [2.0, 0.1] and dashed.get_ydata().tolist() == [-9.0, -1.0]
